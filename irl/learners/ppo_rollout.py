"""A rollout of an SB3 PPO beside its gradient steps: rewards, and densities of its actions."""

from collections.abc import Callable
from functools import partial

import numpy as np
import torch
from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from torch import Tensor

from irl.core.finite import check_finite
from irl.core.types import Metrics, RewardFn, Transitions
from irl.learners.vec import Recorder
from irl.policies import densities
from irl.rewards.normalise import ReturnScale


def by_sb3(model: PPO, venv: Recorder, callback: BaseCallback) -> Callable[[], bool]:
    """SB3's own way of collecting a rollout."""
    return partial(model.collect_rollouts, venv, callback, model.rollout_buffer, model.n_steps)


class Rollouts:
    """What every PPO does between its gradient steps; whoever is one sets these four, and improves."""

    model: PPO
    venv: Recorder
    _scale: ReturnScale
    _fill: Callable[[], object]
    """Collects a rollout into the model's buffer; the environments record it."""
    _batch: Transitions | None = None

    @property
    def env_steps(self) -> int:
        """Environment steps taken so far, over all environments."""
        return self.model.num_timesteps

    @property
    def reward_scale(self) -> float:
        """What the reward is divided by before PPO sees it."""
        return self._scale.std

    def start(
        self, reward: RewardFn, before_update: Callable[[Transitions], Transitions] | None = None
    ) -> None:
        """Nothing: a rollout is rewarded after it is collected.

        Raises:
            ValueError: `before_update` is given; PPO has no replay memory to draw batches from.
        """
        if before_update is not None:
            raise ValueError("PPO draws no batches from a replay memory; use SAC")

    def take_finished(self) -> list[tuple[float, int]]:
        """Return (the environment's own) and length of each episode that ended since the last call."""
        return self.venv.take_finished()

    def collect(self) -> Transitions:
        """One rollout of the current policy, time-major; actions as the environment saw them."""
        self._fill()
        self._batch = self.venv.take().to(self.model.device)
        return self._batch

    def log_pi(self, batch: Transitions) -> Float[Tensor, "B"]:
        """Log density of the batch's own actions, as the environment saw them, under the current policy.

        `irl.policies.densities.clipped`; no normaliser moves and nothing is drawn.
        """
        return log_pi(self.model, batch)

    def rewarded(self, reward: RewardFn) -> tuple[Transitions, Metrics]:
        """Reward the last rollout in one batch; the rollout, and what its rewards were like.

        Raises:
            RuntimeError: nothing was collected since the last call.
            NotFinite: a reward is NaN or infinite.
        """
        if self._batch is None:
            raise RuntimeError("collect a rollout before improving on it")
        batch, self._batch = self._batch, None
        raw = give_rewards(self.model, self._scale, batch, reward)
        return batch, {
            "reward/mean": float(raw.mean()),
            "reward/std": float(raw.std()),
            "reward/scale": self._scale.std,
        }


@torch.no_grad()
def give_rewards(
    model: PPO, scale: ReturnScale, batch: Transitions, reward: RewardFn
) -> Float[np.ndarray, "T N"]:
    """Reward the model's rollout buffer, whose steps `batch` are, and compute its advantages anew.

        r'_t = clip(r_t / std(G)) + [truncated at t] gamma V(s_{t+1})

    Returns the rewards before their scaling, which moves `scale` on.

    Raises:
        NotFinite: a reward is NaN or infinite.
    """
    buffer, shape = model.rollout_buffer, model.rollout_buffer.rewards.shape
    given = reward(batch)
    check_finite({"reward of the rollout": given})
    raw = given.double().cpu().numpy().reshape(shape)
    ended = (batch.terminated | batch.truncated).cpu().numpy().reshape(shape)
    scale.update(raw, ended)
    buffer.rewards[:] = scale(raw)
    cut_off = batch.truncated & ~batch.terminated
    if bool(cut_off.any()):
        values = model.policy.predict_values(batch.next_obs[cut_off].to(model.device))
        where = cut_off.cpu().numpy().reshape(shape)
        buffer.rewards[where] += model.gamma * values.flatten().cpu().numpy()
    assert isinstance(model._last_obs, np.ndarray)
    assert model._last_episode_starts is not None
    last_obs = torch.as_tensor(model._last_obs, device=model.device)
    buffer.compute_returns_and_advantage(model.policy.predict_values(last_obs), model._last_episode_starts)
    return raw


@torch.no_grad()
def log_pi(model: PPO, batch: Transitions) -> Float[Tensor, "B"]:
    """Log density of the batch's own actions, as the environment saw them, under the current policy.

    `irl.policies.densities.clipped`; no normaliser moves and nothing is drawn.

    Raises:
        ValueError: the policy's actions are no clipped Gaussians.
    """
    policy, box = model.policy, model.action_space
    policy.set_training_mode(False)
    normal = policy.get_distribution(batch.obs).distribution
    if model.use_sde or not (isinstance(normal, torch.distributions.Normal) and isinstance(box, Box)):
        raise ValueError("AIRL needs the density of an action: a PPO of Gaussian actions, without use_sde")
    low, high = (torch.as_tensor(bound, device=batch.obs.device) for bound in (box.low, box.high))
    return densities.clipped(batch.action, normal.mean, normal.stddev.log(), low, high)
