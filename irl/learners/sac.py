"""Soft actor-critic (Haarnoja et al. 2018, arXiv:1812.05905) on a reward decided as a batch is drawn.

    y    = r(s, a, s') + gamma (1 - terminated) (min_i Q_i'(s', a') - alpha log pi(a'|s'))
    L_Q  = E[(Q_i(s, a) - y)^2],   L_pi = E[alpha log pi(a|s) - min_i Q_i(s, a)]

The networks are those of Stable-Baselines3's `SAC`; stepping and updating are interleaved in `collect`.
Each batch asks the `RewardFn` when it is drawn, so no stored reward can go stale; a time limit is no
termination.

With `quantiles` critics learn the distribution of returns and its highest atoms are left out: truncated
quantile critics (Kuznetsov et al. 2020, arXiv:2005.04269; `irl.learners.heads`).

Differs from the paper: observations may be normalised, and are clipped then; several environments may be
stepped at once and updated from less or more than once a step; the exported policy may be a moving
average of the weights.
"""

import contextlib
import copy
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
import torch
from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3 import SAC
from stable_baselines3.sac.policies import Actor
from torch import Tensor, nn

from irl.core.config import check_at_least
from irl.core.finite import check_finite, named
from irl.core.nets import CLIP, NO_CLIP, Normaliser, linear
from irl.core.rng import torch_stream
from irl.core.schedule import learning_rate
from irl.core.types import Metrics, RewardFn, Transitions
from irl.learners.adopting import adopt
from irl.learners.averaging import WeightAverage
from irl.learners.features import NormalisedFeatures, Spaces, widened
from irl.learners.heads import Lowest, Quantiles
from irl.learners.replay import Replay
from irl.learners.sac_update import SACUpdate
from irl.learners.vec import RecordingVecEnv
from irl.policies import densities
from irl.policies.policy import Policy, PolicySpec
from irl.rewards.normalise import DrawnScale


@dataclass(frozen=True)
class SACConfig:
    """How the policy is improved: the keywords of SB3's SAC.

    `learning_rate` is `lr` with its schedule, `train_freq` and `gradient_steps` are `updates_per_step`,
    `policy_kwargs` are `hidden` and `n_critics`. There are no `replay_buffer_*`, `optimize_memory_usage` and
    `n_steps`, because the memory is irl's own and rewards are decided as a batch is drawn, no `use_sde`,
    because an exported policy has no such noise, and no `action_noise`: SAC draws its actions.
    """

    KIND: ClassVar[str] = "sac"
    ADDED: ClassVar[dict[str, Any]] = {
        "n_envs": 1,
        "updates_per_step": 1.0,
        "target_update_interval": 1,
        "ent_coef": "auto",
        "target_entropy": "auto",
        "n_critics": 2,
        "quantiles": 0,
        "dropped_quantiles": 2,
        "products": "float32",
        "reward_scaling": "none",
        "reward_clip": 0.0,
    }
    n_envs: int = 1
    """Environments stepped at once."""
    steps_per_round: int = 1000
    """Environment steps between two reports; a multiple of `n_envs`."""
    updates_per_step: float = 1.0
    """Updates per environment step."""
    learning_starts: int = 5000
    """Steps of uniformly random actions before the first update."""
    batch_size: int = 256
    """Transitions of one update."""
    buffer_size: int = 1_000_000
    """Transitions kept."""
    lr: float = 3e-4
    """Adam step size of actor, critics and temperature."""
    lr_schedule: Literal["constant", "linear"] = "constant"
    """`constant`, or `linear` from `lr` to 0 over the run."""
    gamma: float = 0.99
    """Discount per environment step."""
    tau: float = 0.005
    """How far the target critics follow."""
    target_update_interval: int = 1
    """Updates between two such steps of the target critics."""
    ent_coef: str = "auto"
    """Temperature: `auto` learns it from 1, `auto_0.1` from 0.1, and a number stays."""
    target_entropy: str = "auto"
    """Entropy that a learned temperature aims at, nats: a number; `auto` is minus the number of actions."""
    n_critics: int = 2
    """Critics; the lowest counts."""
    quantiles: int = 0
    """Atoms of each critic's distribution of returns (TQC, e.g. 25); 0: a critic says one number (SAC)."""
    dropped_quantiles: int = 2
    """Highest atoms of each critic that count in no target; only with `quantiles`."""
    hidden: tuple[int, ...] = (256, 256)
    """Width of each hidden layer of actor and critics, ReLU between."""
    products: Literal["float32", "bfloat16"] = "float32"
    """Number format of hidden layers' products. bfloat16 is faster where the CPU has it, and rounds to
    three digits: results differ from float32's, and what that does to a return is not measured yet."""
    reward_scaling: Literal["none", "std"] = "none"
    """What rewards are divided by: nothing, or the running deviation of all that were drawn."""
    reward_clip: float = 0.0
    """Bound of a reward after that; 0: none. What is saved is the reward before both."""
    average: float = 0.0
    """Decay a round of the moving average of weights that is exported; 0 exports the newest."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "n_envs", "steps_per_round", "batch_size", "buffer_size")
        check_at_least(self, 1, "target_update_interval", "n_critics")
        _check_number_or_auto("ent_coef", self.ent_coef, self.ent_coef.removeprefix("auto_"), 0.0)
        _check_number_or_auto("target_entropy", self.target_entropy, self.target_entropy, -math.inf)
        check_at_least(self, 0, "learning_starts", "lr", "tau", "updates_per_step", "reward_clip")
        check_at_least(self, 0, "quantiles", "dropped_quantiles")
        if self.quantiles and self.dropped_quantiles >= self.quantiles:
            raise ValueError(
                f"dropped_quantiles must be below quantiles ({self.quantiles}), not {self.dropped_quantiles}"
            )
        if self.steps_per_round % self.n_envs:
            raise ValueError(
                f"steps_per_round must be a multiple of n_envs ({self.n_envs}), not {self.steps_per_round}"
            )
        for name in ("gamma", "average"):
            if not 0.0 <= (value := getattr(self, name)) < 1.0:
                raise ValueError(f"{name} must be in [0, 1), not {value}")


class SACLearner:
    """Steps environments and updates after each step.

    For `learning_starts` steps actions are random and nothing is learned. SB3 seeds the global
    generators and draws the first weights from them; nothing after that does.
    """

    def __init__(
        self,
        env_id: str,
        env_seeds: list[int],
        config: SACConfig,
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
        self.model = self._sb3(seed, device)
        self._rng = torch_stream(seed, "sac", device)
        dtype = torch.bfloat16 if config.products == "bfloat16" else torch.float32
        head = Quantiles(config.quantiles, config.dropped_quantiles) if config.quantiles else Lowest()
        self._widen_critics(head.outputs, torch_stream(seed, "critics"))
        self._update = SACUpdate(self.model, self._normaliser, self._rng, dtype, absorbing_scale, head)
        capacity = min(config.buffer_size, total_steps + config.steps_per_round)
        self.replay = Replay(capacity, config.n_envs, obs_size, len(self._low), device)
        self._average = WeightAverage(_actor_weights(self.model.actor), config.average)
        self._rate = learning_rate(config.lr, config.lr_schedule)
        self._scale = DrawnScale(scaled=config.reward_scaling == "std", clip=config.reward_clip)
        self._env_steps, self._owed = 0, 0.0
        self.venv.reset()

    def _sb3(self, seed: int, device: str) -> SAC:
        config = self.config
        normaliser, env = copy.deepcopy(self._normaliser), Spaces(self.venv, self._absorbing)
        if self._absorbing:
            normaliser = widened(normaliser)
        return SAC(
            "MlpPolicy",
            env,
            learning_rate=learning_rate(config.lr, config.lr_schedule),
            buffer_size=1,  # SB3's own memory is not used
            learning_starts=config.learning_starts,
            batch_size=config.batch_size,
            tau=config.tau,
            gamma=config.gamma,
            ent_coef=_as_sb3(config.ent_coef),
            target_entropy=_as_sb3(config.target_entropy),
            target_update_interval=config.target_update_interval,
            policy_kwargs={
                "net_arch": list(config.hidden),
                "n_critics": config.n_critics,
                "features_extractor_class": NormalisedFeatures,
                "features_extractor_kwargs": {"normaliser": normaliser},
            },
            seed=seed,
            device=device,
        )

    def _widen_critics(self, outputs: int, rng: torch.Generator) -> None:
        """Give SB3's critics more than one output; the targets begin as their copies."""
        critic, target = self.model.critic, self.model.critic_target
        for net, following in zip(critic.q_networks, target.q_networks, strict=True):
            assert isinstance(net, nn.Sequential)
            assert isinstance(following, nn.Sequential)
            if outputs > 1:
                net[-1] = linear(self.config.hidden[-1], outputs, rng).to(self.model.device)
                following[-1] = copy.deepcopy(net[-1])

    @property
    def env_steps(self) -> int:
        """Environment steps taken so far."""
        return self._env_steps

    @property
    def reward_scale(self) -> float:
        """What the reward is divided by before SAC sees it."""
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
        self._average.update(_actor_weights(self.model.actor))
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
        obs = torch.as_tensor(self.venv.obs, dtype=torch.float32, device=self.model.device)
        action = self._update.sample(self._update.features(obs))
        return np.clip(self._update.unscaled(action).cpu().numpy(), self._low, self._high)

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

    @torch.no_grad()
    def log_pi(self, batch: Transitions) -> Float[Tensor, "B"]:
        """Log density of the batch's own actions, in environment units, under the current policy.

        `irl.policies.densities.squashed`; no normaliser moves and nothing is drawn.
        """
        features = self._update.features(batch.obs, batch.absorbing)
        half = torch.as_tensor((self._high - self._low) / 2, device=batch.obs.device)
        return densities.squashed(self._update.scaled(batch.action), *self._update.gaussian(features), half)

    def improve(self, reward: RewardFn) -> Metrics:
        """Name the reward of the next rounds; what the last update was like."""
        self._reward = reward
        return self._update.metrics()

    def policy(self) -> Policy:
        """The current policy, exported: a copy that later updates leave alone."""
        weights = {name: weight.numpy().copy() for name, weight in self._average.weights.items()}
        # nobody acts in the absorbing state, so its indicator is 0 for whoever acts
        weights["layers.0.weight"] = weights["layers.0.weight"][:, : len(self._normaliser.mean)].copy()
        mean, std = self._normaliser.mean, self._normaliser.std
        weights |= {"obs_mean": mean.cpu().numpy().copy(), "obs_std": std.cpu().numpy().copy()}
        if self._normaliser.clip != CLIP:
            weights["obs_clip"] = np.float32(self._normaliser.clip)
        weights |= {"action_low": self._low, "action_high": self._high}
        sizes = (len(mean), len(self._low))
        return Policy(
            PolicySpec(self.env_id, *sizes, self.config.hidden, "relu", "squashed_gaussian"), weights
        )

    def adopt(self, policy: Policy) -> None:
        """Act as `policy` does from now on; the random steps at the start stay.

        Raises:
            ValueError: its layers are of other sizes.
        """
        adopt(_acting(self.model.actor), policy)
        self._update.refresh()
        self._average = WeightAverage(_actor_weights(self.model.actor), self.config.average)

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        return {
            "policy": self.model.policy.state_dict(),
            "optimizers": [optimizer.state_dict() for optimizer in self._update.optimizers],
            "log_ent_coef": self.model.log_ent_coef,
            "steps": (self._env_steps, self._owed, self._update.updates),
            "last_obs": self.venv.obs,
            "replay": self.replay.state_dict(),
            "scale": self._scale.state_dict(),
            "average": self._average.state_dict(),
            "environments": self.venv.state_dict(),
            "rng": self._rng.get_state(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another learner of the same settings was; `start` names the reward."""
        self.model.policy.load_state_dict(state["policy"])
        self._update.refresh()
        for optimizer, its in zip(self._update.optimizers, state["optimizers"], strict=True):
            optimizer.load_state_dict(its)
        with torch.no_grad():
            if isinstance(self.model.log_ent_coef, Tensor):
                self.model.log_ent_coef.copy_(state["log_ent_coef"])
        self._env_steps, self._owed, self._update.updates = state["steps"]
        self.replay.load_state_dict(state["replay"])
        self._average.load_state_dict(state["average"])
        # checkpoints of before there was one have none
        self._scale.load_state_dict(state.get("scale", (0.0, 0.0, 0.0)))
        self.venv.load_state_dict(state["environments"])
        self.venv.resume_from(state["last_obs"])
        self._rng.set_state(state["rng"])

    def close(self) -> None:
        """Close the environment."""
        self.venv.close()


def _check_number_or_auto(name: str, given: str, number: str, above: float) -> None:
    with contextlib.suppress(ValueError):
        if given == "auto" or above < float(number) < math.inf:
            return
    words = "auto, auto_0.1 or a number above 0" if above == 0.0 else "auto or a number"
    raise ValueError(f"{name} must be {words}, not {given!r}")


def _as_sb3(given: str) -> str | float:
    return given if given.startswith("auto") else float(given)


def _actor_weights(actor: Actor) -> dict[str, Tensor]:
    return {name: weight.cpu() for name, weight in _acting(actor).items()}


def _acting(actor: Actor) -> dict[str, Tensor]:
    """The weights that make the policy act, under the names that `Policy` has for them."""
    layers = [m for m in actor.latent_pi if isinstance(m, nn.Linear)]
    assert isinstance(actor.mu, nn.Linear)
    assert isinstance(actor.log_std, nn.Linear)
    weights: dict[str, Tensor] = {}
    for i, layer in enumerate([*layers, actor.mu]):
        weights |= {f"layers.{i}.weight": layer.weight, f"layers.{i}.bias": layer.bias}
    weights |= {"log_std.weight": actor.log_std.weight, "log_std.bias": actor.log_std.bias}
    return {name: weight.detach() for name, weight in weights.items()}
