"""SB3's replay buffer with the reward decided when a batch is drawn, never when it is stored."""

from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize

from irl.core.types import RewardFn, Transitions

COLUMNS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


class RewardedReplay(ReplayBuffer):
    """Transitions whose reward is `self.reward` of the batch at the moment it is sampled.

    What is stored as reward is the environment's own, for a `RewardFn` that asks for it. Float32
    throughout: MuJoCo's float64 observations would double the memory.
    """

    def __init__(self, buffer_size: int, observation_space: Box, action_space: Box, **more: Any) -> None:
        low, high = (bound.astype(np.float32) for bound in (observation_space.low, observation_space.high))
        narrow = Box(low, high, dtype=np.float32)
        super().__init__(buffer_size, narrow, action_space, **more)
        self.reward: RewardFn | None = None
        low, high = action_space.low, action_space.high
        self._center = torch.as_tensor((high + low) / 2, device=self.device)
        self._half = torch.as_tensor((high - low) / 2, device=self.device)

    def add(
        self,
        obs: np.ndarray,
        next_obs: np.ndarray,
        action: np.ndarray,
        reward: np.ndarray,
        done: np.ndarray,
        infos: list[dict[str, Any]],
    ) -> None:
        """Store one step of every environment; the reward handed on by the environments is zeros."""
        own = np.array([info["own_reward"] for info in infos])
        super().add(obs, next_obs, action, own, done, infos)

    def _get_samples(self, batch_inds: np.ndarray, env: VecNormalize | None = None) -> ReplayBufferSamples:
        envs = np.random.randint(0, self.n_envs, size=len(batch_inds))
        obs, next_obs, action, own, done, timeout = (
            self.to_torch(getattr(self, name)[batch_inds, envs]) for name in COLUMNS
        )
        assert self.reward is not None, "give the buffer a reward before sampling from it"
        truncated = timeout.bool()
        terminated = done.bool() & ~truncated
        # the buffer holds SAC's actions in [-1, 1]; rewards judge what the environment saw
        batch = Transitions(
            obs, action * self._half + self._center, next_obs, terminated, truncated, own.double()
        )
        with torch.no_grad():
            reward = self.reward(batch).float()
        return ReplayBufferSamples(obs, action, next_obs, terminated.float()[:, None], reward[:, None])

    def state_dict(self) -> dict[str, Any]:
        """Everything stored so far. Cost: the whole buffer."""
        stored = self.buffer_size if self.full else self.pos
        columns = {name: getattr(self, name)[:stored] for name in COLUMNS}
        return {"columns": columns, "pos": self.pos, "full": self.full}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another buffer of the same size was."""
        for name, values in state["columns"].items():
            getattr(self, name)[: len(values)] = values
        self.pos, self.full = state["pos"], state["full"]
