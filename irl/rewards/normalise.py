"""Rewards brought to a scale a value function can follow.

    G_t = gamma G_{t-1} + r_t   (0 after an episode's end)
    r'  = clip(r / sqrt(Var[G]), -c, c),   or without a scale, or without a bound

Off policy rewards are drawn from a memory, in no order of time: there it is the deviation of all that were
drawn, sqrt(Var[r]). The mean stays where it is: in a task that can end early, a constant is a survival bonus.
"""

from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor


class ReturnScale:
    """The running standard deviation of the discounted return of N parallel environments.

    Source: the reward scaling of Engstrom et al. (2020), arXiv:2005.12729, section 3.
    """

    def __init__(self, n_envs: int, gamma: float, *, scaled: bool = True, clip: float = 0.0) -> None:
        """Without `scaled` the deviation counts as 1; `clip` bounds what is scaled, 0 does not."""
        self.gamma, self._scaled, self._clip = gamma, scaled, clip
        self._returns = np.zeros(n_envs)
        self._count, self._mean, self._squares = 0.0, 0.0, 0.0

    @property
    def std(self) -> float:
        """Standard deviation of every discounted return seen; 1 before there are two."""
        if not self._scaled or self._count < 2 or self._squares <= 0.0:
            return 1.0
        return float(np.sqrt(self._squares / self._count))

    def __call__(self, reward: Float[np.ndarray, "T N"]) -> Float[np.ndarray, "T N"]:
        """What the learner is given."""
        scaled = reward / self.std
        return np.clip(scaled, -self._clip, self._clip) if self._clip else scaled

    def update(self, reward: Float[np.ndarray, "T N"], done: Bool[np.ndarray, "T N"]) -> None:
        """Take in one rollout, in time order; `done` is where an episode ended with that step."""
        returns = np.empty(reward.shape)
        for t in range(len(reward)):
            self._returns = self.gamma * self._returns + reward[t]
            returns[t] = self._returns
            self._returns = np.where(done[t], 0.0, self._returns)
        size, total = returns.size, self._count + returns.size
        delta = float(returns.mean()) - self._mean
        self._squares += float(returns.var()) * size + delta**2 * self._count * size / total
        self._mean += delta * size / total
        self._count = total

    def state_dict(self) -> dict[str, Any]:
        """Everything that `load_state_dict` needs."""
        moments = (self._count, self._mean, self._squares)
        return {"returns": self._returns.copy(), "moments": moments}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another one was."""
        self._returns = state["returns"].copy()
        self._count, self._mean, self._squares = state["moments"]


class DrawnScale:
    """The running standard deviation of every reward drawn from a memory."""

    def __init__(self, *, scaled: bool, clip: float) -> None:
        """Without `scaled` the deviation counts as 1; `clip` bounds what is scaled, 0 does not."""
        self._scaled, self._clip = scaled, clip
        self._count, self._mean, self._squares = 0.0, 0.0, 0.0

    @property
    def std(self) -> float:
        """Standard deviation of all that were drawn; 1 before they differ."""
        if not self._scaled or self._squares <= 0.0:
            return 1.0
        return float(np.sqrt(self._squares / self._count))

    def __call__(self, reward: Float[Tensor, "B"]) -> Float[Tensor, "B"]:
        """What the learner is given, of a batch just drawn, which is taken in first."""
        if self._scaled:
            size, total = len(reward), self._count + len(reward)
            drawn = reward.double()
            delta = float(drawn.mean()) - self._mean
            self._squares += float(drawn.var(correction=0)) * size + delta**2 * self._count * size / total
            self._mean, self._count = self._mean + delta * size / total, total
            reward = reward / self.std
        return torch.clamp(reward, -self._clip, self._clip) if self._clip else reward

    def state_dict(self) -> tuple[float, float, float]:
        """Everything that `load_state_dict` needs."""
        return self._count, self._mean, self._squares

    def load_state_dict(self, state: tuple[float, float, float]) -> None:
        """Go on where another one was."""
        self._count, self._mean, self._squares = state
