"""A model of Stable-Baselines3's that somebody made, as a learner: its networks, settings and environments.

SB3 collects and does the gradient steps, as in `model.learn`; the reward is a `RewardFn`. PPO's rollout is
rewarded before its gradient steps, SAC's batches as they are drawn. Neither sees what the environment pays.
The model is trained in place. Slower than irl's own learners, and without checkpoints: `model.save` is SB3's.
"""

from collections.abc import Callable
from typing import Any

import torch
from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples, TrainFreq
from stable_baselines3.common.vec_env import VecEnvWrapper, VecNormalize
from torch import Tensor

from irl.core.finite import check_finite, named
from irl.core.types import Metrics, RewardFn, Transitions
from irl.envs.absorbing import absorb
from irl.learners.ppo_rollout import Rollouts, by_sb3
from irl.learners.vec import Recorder
from irl.policies import densities
from irl.policies.policy import Policy
from irl.rewards.normalise import ReturnScale


class _Ready:
    """What both have in common."""

    def __init__(self, model: PPO | SAC, steps: int) -> None:
        check_model(model)
        assert model.env is not None
        self._given, self._before = model, model.env
        self.venv = Recorder(model.env)
        model.set_env(self.venv)
        _, self._callback = model._setup_learn(steps, callback=None)
        self.steps = steps

    def take_finished(self) -> list[tuple[float, int]]:
        """Return (the environment's own) and length of each episode that ended since the last call."""
        return self.venv.take_finished()

    def policy(self) -> Policy:
        """Raises NotImplementedError: the policy is the model."""
        raise NotImplementedError("the policy is the model that was passed in; save it with model.save")

    def state_dict(self) -> dict[str, Any]:
        """Raises NotImplementedError: irl cannot know what is in the model's environments."""
        raise NotImplementedError("a model that was passed in has no checkpoints of irl's; use model.save")

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Raises NotImplementedError, as `state_dict` does."""
        self.state_dict()

    def close(self) -> None:
        """Give the model its environments back, which pay what they paid; they stay open."""
        self._given.set_env(self._before)


class ReadyPPO(_Ready, Rollouts):
    """PPO as it was passed in."""

    def __init__(self, model: PPO, steps: int) -> None:
        super().__init__(model, steps)
        self.model = model
        self._scale = ReturnScale(model.n_envs, model.gamma)
        self._fill = by_sb3(model, self.venv, self._callback)

    def improve(self, reward: RewardFn) -> Metrics:
        """Reward the last rollout in one batch and do SB3's gradient steps on it.

        Raises:
            RuntimeError: nothing was collected since the last call.
            NotFinite: the reward, or a weight after the steps, is NaN or infinite.
        """
        _, rewards = self.rewarded(reward)
        self.model._update_current_progress_remaining(self.env_steps, self.steps)
        self.model.train()
        check_finite(named("policy", self.model.policy.state_dict()))
        return rewards


class ReadySAC(_Ready):
    """SAC as it was passed in, its memory rewarded anew whenever a batch is drawn."""

    def __init__(
        self, model: SAC, steps: int, steps_per_round: int = 1000, *, absorbing: bool = False
    ) -> None:
        """`steps_per_round` lie between two reports; `absorbing` is told of `RewardedReplay`."""
        super().__init__(model, steps)
        self.model, self._per_round = model, steps_per_round
        self._memory_before = model.replay_buffer
        self._memory = model.replay_buffer = RewardedReplay(model, absorbing)
        _, self._half = _center_and_half(model)

    def close(self) -> None:
        """Give the model its environments and its memory back, as they were."""
        super().close()
        self.model.replay_buffer = self._memory_before

    @property
    def env_steps(self) -> int:
        """Environment steps taken so far, over all environments."""
        return self.model.num_timesteps

    @property
    def reward_scale(self) -> float:
        """Rewards reach SAC as they are."""
        return 1.0

    def start(
        self, reward: RewardFn, before_update: Callable[[Transitions], Transitions] | None = None
    ) -> None:
        """Name the reward that every drawn batch is given, and who sees each batch before that."""
        self._memory.reward, self._memory.before_update = reward, before_update

    def collect(self) -> Transitions:
        """The steps of one round, between them the updates of SB3."""
        model, until = self.model, self.env_steps + self._per_round
        assert isinstance(model.train_freq, TrainFreq)
        while self.env_steps < until:
            taken = model.collect_rollouts(
                self.venv,
                self._callback,
                model.train_freq,
                self._memory,
                model.action_noise,
                model.learning_starts,
            )
            if self.env_steps > model.learning_starts:
                updates = model.gradient_steps if model.gradient_steps >= 0 else taken.episode_timesteps
                if updates:
                    model.train(updates, model.batch_size)
        check_finite(named("policy", model.policy.state_dict()))
        return self.venv.take().to(model.device)

    @torch.no_grad()
    def log_pi(self, batch: Transitions) -> Float[Tensor, "B"]:
        """Log density of the batch's own actions (`irl.policies.densities.squashed`)."""
        self.model.policy.set_training_mode(False)
        mean, log_std, _ = self.model.actor.get_action_dist_params(batch.obs)
        return densities.squashed(self._memory.scaled(batch.action), mean, log_std, self._half)

    def improve(self, reward: RewardFn) -> Metrics:
        """Name the reward of the next rounds."""
        self._memory.reward = reward
        return {}


class RewardedReplay(ReplayBuffer):
    """SB3's memory, which asks a `RewardFn` what each drawn batch is worth."""

    reward: RewardFn
    before_update: Callable[[Transitions], Transitions] | None = None

    def __init__(self, model: SAC, absorbing: bool) -> None:
        """An empty one, of the size and for the spaces of the model's.

        `before_update` sees each batch; what it returns is left alone, because SAC trains on what was drawn.
        With `absorbing`, it sees terminations led into the absorbing state
        (`irl.envs.absorbing`); SAC's networks know none, so the reward adds what it pays.
        """
        self._absorbing = absorbing
        box = model.action_space
        assert isinstance(box, Box)
        super().__init__(
            model.buffer_size, model.observation_space, box, device=model.device, n_envs=model.n_envs
        )
        self._center, self._extent = _center_and_half(model)

    def scaled(self, action: Float[Tensor, "B A"]) -> Float[Tensor, "B A"]:
        """Environment units to [-1, 1]."""
        return (action - self._center) / self._extent

    def sample(self, batch_size: int, env: Any = None) -> ReplayBufferSamples:
        """Drawn as SB3 draws; rewards in the place of those stored, which are zeros.

        Raises:
            NotFinite: a reward is NaN or infinite.
        """
        drawn = super().sample(batch_size, env)
        ended = drawn.dones.flatten() > 0.5
        batch = Transitions(
            drawn.observations.float(),
            drawn.actions * self._extent + self._center,
            drawn.next_observations.float(),
            ended,
            torch.zeros_like(ended),
        )
        if self.before_update is not None:
            self.before_update(absorb(batch) if self._absorbing else batch)
        with torch.no_grad():
            reward = self.reward(batch).float()
        check_finite({"reward of a drawn batch": reward})
        return drawn._replace(rewards=reward.unsqueeze(1))


def _center_and_half(model: SAC) -> tuple[Float[Tensor, "A"], Float[Tensor, "A"]]:
    """Of the range of actions, of the networks' own dtype whatever that of the bounds."""
    box = model.action_space
    assert isinstance(box, Box)
    ends = (box.high + box.low) / 2, (box.high - box.low) / 2
    center, half = (torch.as_tensor(end, dtype=torch.float32, device=model.device) for end in ends)
    return center, half


def ready(model: BaseAlgorithm, steps: int, *, absorbing: bool = False) -> ReadyPPO | ReadySAC:
    """The learner that `model` is, for `steps` environment steps.

    `absorbing`: the discriminator knows the absorbing state, and is to be shown it.

    Raises:
        ValueError: it is another algorithm, or its environments or memory are not what a reward can be
            learned beside; the message says which.
    """
    if type(model) is PPO:
        return ReadyPPO(model, steps)
    if type(model) is SAC:
        return ReadySAC(model, steps, absorbing=absorbing)
    if (
        "Recurrent" in (name := type(model).__name__)
        or "Recurrent" in type(getattr(model, "policy", None)).__name__
    ):
        raise ValueError(
            f"{name} remembers what it saw, and a reward is learned of single steps, whose density and value "
            f"would be without their past; use a PPO or SAC with an MlpPolicy, and put what must be "
            f"remembered into the observation (gymnasium.wrappers.FrameStackObservation, flattened)"
        )
    raise ValueError(f"expected a PPO or SAC of stable_baselines3, not {name}")


def check_model(model: BaseAlgorithm) -> None:
    """Refuse a model that a reward cannot be learned beside.

    Raises:
        ValueError: the message says why.
    """
    venv = model.env
    if venv is None:
        raise ValueError("the model has no environment; model.set_env(env) gives it one")
    for space, what in ((model.observation_space, "observations"), (model.action_space, "actions")):
        if not isinstance(space, Box) or len(space.shape) != 1:
            raise ValueError(f"{what} must be a flat Box, not {space}")
    while isinstance(venv, VecEnvWrapper):
        if isinstance(venv, VecNormalize):
            raise ValueError(
                "the model sees VecNormalize's observations, which move and are not the demonstrations'; "
                "make it without (PPO's rewards are scaled here)"
            )
        venv = venv.venv
    memory = getattr(model, "replay_buffer", None)
    if memory is not None and (type(memory) is not ReplayBuffer or memory.optimize_memory_usage):
        raise ValueError(
            f"the model's memory must be SB3's plain ReplayBuffer without optimize_memory_usage, not "
            f"{type(memory).__name__}: its rewards are replaced as they are drawn"
        )
