"""Learning off policy on a reward decided as a batch is drawn: what SAC and TD3 have in common.

Stepping and updating are interleaved in `collect`. Each batch asks the `RewardFn` when it is drawn, so no
stored reward can go stale; a time limit is no termination. What is learned from a batch is the update's
(`irl.learners.sac_update`, `irl.learners.td3_update`).
"""

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, Generic, Protocol, TypeVar, runtime_checkable

import numpy as np
import torch
from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from torch import Tensor

from irl.core.finite import check_finite, named
from irl.core.nets import CLIP, NO_CLIP, Normaliser
from irl.core.rng import torch_stream
from irl.core.schedule import learning_rate
from irl.core.types import Metrics, RewardFn, Transitions
from irl.learners.adopting import adopt, seeing
from irl.learners.averaging import WeightAverage
from irl.learners.features import NormalisedFeatures, Spaces, widened
from irl.learners.inputs import Inputs
from irl.learners.off_policy_config import OffPolicyConfig
from irl.learners.replay import Replay
from irl.learners.vec import RecordingVecEnv
from irl.policies.policy import Policy, PolicySpec
from irl.rewards.normalise import DrawnScale


@runtime_checkable
class Update(Protocol):
    """The networks of a model of SB3's, and the step that changes them."""

    inputs: Inputs
    optimizers: list[torch.optim.Adam]
    updates: int

    def __call__(self, batch: Transitions, reward: Float[Tensor, "B"], lr: float) -> None: ...
    def refresh(self) -> None:
        """Told after the weights were loaded."""
        ...

    def metrics(self) -> Metrics: ...


C = TypeVar("C", bound=OffPolicyConfig)
M = TypeVar("M", bound=OffPolicyAlgorithm)
U = TypeVar("U", bound=Update)


class OffPolicyLearner(ABC, Generic[C, M, U]):
    """Steps environments and updates after each step.

    For `learning_starts` steps actions are random and nothing is learned. SB3 seeds the global
    generators and draws the first weights from them; nothing after that does.
    """

    DISTRIBUTION: ClassVar[str]
    """Of the exported policy."""

    def __init__(
        self,
        env_id: str,
        env_seeds: list[int],
        config: C,
        *,
        seed: int,
        total_steps: int,
        normaliser: Normaliser | None = None,
        absorbing_scale: float = 0.0,
        device: str = "cpu",
    ) -> None:
        """`normaliser` is kept as it is; without one, networks see observations as they are.

        With `absorbing_scale`, terminations lead into the absorbing state (`irl.envs.absorbing`), which
        critics see at that distance from the others.
        """
        self._absorbing = absorbing_scale > 0
        self.config, self.env_id, self._total_steps = config, env_id, total_steps
        self.venv = RecordingVecEnv(env_id, env_seeds)
        box = self.venv.action_space
        assert isinstance(box, Box)
        self._low, self._high = box.low, box.high
        assert self.venv.observation_space.shape is not None
        obs_size = self.venv.observation_space.shape[0]
        self._normaliser = (normaliser or Normaliser(obs_size, NO_CLIP)).to(device)
        self._rng = torch_stream(seed, config.KIND, device)
        self.model = self._sb3(Spaces(self.venv, self._absorbing), self._common(seed, device))
        self._update = self._made(seed, absorbing_scale)
        capacity = min(config.buffer_size, total_steps + config.steps_per_round)
        self.replay = Replay(capacity, config.n_envs, obs_size, len(self._low), device)
        self._average = WeightAverage(self._weights(), config.average)
        self._rate = learning_rate(config.lr, config.lr_schedule)
        self._scale = DrawnScale(scaled=config.reward_scaling == "std", clip=config.reward_clip)
        self._env_steps, self._owed = 0, 0.0
        self.venv.reset()

    @abstractmethod
    def _sb3(self, env: Spaces, common: dict[str, Any]) -> M:
        """The model whose networks they are; `common` are keywords of every off-policy one of SB3's."""

    @abstractmethod
    def _made(self, seed: int, absorbing_scale: float) -> U:
        """What changes `self.model`."""

    @abstractmethod
    def _explore(self, features: Float[Tensor, "B F"]) -> Float[Tensor, "B A"]:
        """Actions to take, within [-1, 1]; what lies outside is cut."""

    @abstractmethod
    def _actors(self) -> list[dict[str, Tensor]]:
        """The weights that make the policy act, under `Policy`'s names, and those of what follows them."""

    @abstractmethod
    def _more(self) -> dict[str, Any]:
        """What else a checkpoint holds."""

    @abstractmethod
    def _load_more(self, state: dict[str, Any]) -> None:
        """The other way round, from a whole checkpoint."""

    def _common(self, seed: int, device: str) -> dict[str, Any]:
        config, normaliser = self.config, copy.deepcopy(self._normaliser)
        return {
            "learning_rate": learning_rate(config.lr, config.lr_schedule),
            "buffer_size": 1,  # SB3's own memory is not used
            "learning_starts": config.learning_starts,
            "batch_size": config.batch_size,
            "tau": config.tau,
            "gamma": config.gamma,
            "policy_kwargs": {
                "net_arch": list(config.hidden),
                "n_critics": config.n_critics,
                "features_extractor_class": NormalisedFeatures,
                "features_extractor_kwargs": {
                    "normaliser": widened(normaliser) if self._absorbing else normaliser
                },
            },
            "seed": seed,
            "device": device,
        }

    @property
    def env_steps(self) -> int:
        """Environment steps taken so far."""
        return self._env_steps

    @property
    def reward_scale(self) -> float:
        """What the reward is divided by before the learner sees it."""
        return self._scale.std

    def take_finished(self) -> list[tuple[float, int]]:
        """Return (the environment's own) and length of each episode that ended since the last call."""
        return self.venv.take_finished()

    def start(
        self, reward: RewardFn, before_update: Callable[[Transitions], Transitions] | None = None
    ) -> None:
        """Name the reward that every sampled batch is given, and who says what is learned from instead."""
        self._reward, self._before_update = reward, before_update

    def collect(self) -> Transitions:
        """The steps of one round; each is followed by its updates once the random ones are over.

        Raises:
            NotFinite: a drawn batch's reward, or a weight after the round, is NaN or infinite.
        """
        for _ in range(self.config.steps_per_round // self.config.n_envs):
            self._step()
            if self._env_steps > self.config.learning_starts:
                self._owed += self.config.updates_per_step * self.config.n_envs
            while self._owed >= 1.0:
                self._learn()
                self._owed -= 1.0
        for what in ("critic", "actor"):
            check_finite(named(what, getattr(self.model, what).state_dict()))
        # before anything is learned there is nothing to average but the random start
        if self._update.updates:
            self._average.update(self._weights())
        return self.venv.take().to(self.model.device)

    def _step(self) -> None:
        self.venv.step(self._random() if self._env_steps < self.config.learning_starts else self._act())
        self.replay.add(*self.venv.last_step)
        self._env_steps += self.config.n_envs

    def _random(self) -> np.ndarray:
        drawn = torch.rand(len(self.venv.obs), len(self._low), generator=self._rng, device=self._rng.device)
        return self._low + drawn.cpu().numpy() * (self._high - self._low)

    @torch.no_grad()
    def _act(self) -> np.ndarray:
        inputs = self._update.inputs
        obs = torch.as_tensor(self.venv.obs, dtype=torch.float32, device=self.model.device)
        action = inputs.unscaled(self._explore(inputs.features(obs)))
        return np.clip(action.cpu().numpy(), self._low, self._high)

    def _learn(self) -> None:
        draw = self.replay.sample_absorbing if self._absorbing else self.replay.sample
        batch = draw(self.config.batch_size, self._rng)
        if self._before_update is not None:
            batch = self._before_update(batch)
        with torch.no_grad():
            reward = self._reward(batch).float()
        check_finite({"reward of a drawn batch": reward})
        reward = self._scale(reward)
        remaining = 1.0 - self._env_steps / self._total_steps
        self._update(batch, reward, self._rate(remaining) if callable(self._rate) else self._rate)

    def improve(self, reward: RewardFn) -> Metrics:
        """Name the reward of the next rounds; what the last update was like."""
        self._reward = reward
        return self._update.metrics()

    def policy(self) -> Policy:
        """The current policy, exported: a copy that later updates leave alone."""
        weights = {name: weight.numpy().copy() for name, weight in self._average.weights.items()}
        # nobody acts in the absorbing state, so its indicator is 0 for whoever acts
        for name in weights.keys() & seeing(self.config.hidden):
            weights[name] = weights[name][:, : len(self._normaliser.mean)].copy()
        mean, std = self._normaliser.mean, self._normaliser.std
        weights |= {"obs_mean": mean.cpu().numpy().copy(), "obs_std": std.cpu().numpy().copy()}
        if self._normaliser.clip != CLIP:
            weights["obs_clip"] = np.float32(self._normaliser.clip)
        weights |= {"action_low": self._low, "action_high": self._high}
        sizes = (len(mean), len(self._low))
        spec = PolicySpec(self.env_id, *sizes, self.config.hidden, "relu", self.DISTRIBUTION)
        return Policy(spec, weights)

    def adopt(self, policy: Policy) -> None:
        """Act as `policy` does from now on; the random steps at the start stay.

        Raises:
            ValueError: its layers are of other sizes.
        """
        for actor in self._actors():
            adopt(actor, policy)
        self._update.refresh()
        self._average = WeightAverage(self._weights(), self.config.average)

    def _weights(self) -> dict[str, Tensor]:
        return {name: weight.cpu() for name, weight in self._actors()[0].items()}

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        return {
            "policy": self.model.policy.state_dict(),
            "optimizers": [optimizer.state_dict() for optimizer in self._update.optimizers],
            "steps": (self._env_steps, self._owed, self._update.updates),
            "last_obs": self.venv.obs,
            "replay": self.replay.state_dict(),
            "scale": self._scale.state_dict(),
            "average": self._average.state_dict(),
            "environments": self.venv.state_dict(),
            "rng": self._rng.get_state(),
        } | self._more()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another learner of the same settings was; `start` names the reward.

        Raises:
            UserError: the task draws from a generator of its own, so its place cannot be found again.
        """
        self.model.policy.load_state_dict(state["policy"])
        self._update.refresh()
        for optimizer, its in zip(self._update.optimizers, state["optimizers"], strict=True):
            optimizer.load_state_dict(its)
        self._load_more(state)
        self._env_steps, self._owed, self._update.updates = state["steps"]
        self.replay.load_state_dict(state["replay"])
        self._average.load_state_dict(state["average"])
        # checkpoints of before there was one have none
        self._scale.load_state_dict(state.get("scale", (0.0, 0.0, 0.0)))
        self.venv.load_state_dict(state["environments"], state["last_obs"])
        self._rng.set_state(state["rng"])

    def close(self) -> None:
        """Close the environment."""
        self.venv.close()
