"""Rewards brought to a scale a value function can follow.

    G_t = gamma G_{t-1} + r_t   (0 after an episode's end)
    r'  = r / sqrt(Var[G])

The mean stays where it is: in a task that can end early, a constant is a survival bonus.
"""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float


class ReturnScale:
    """The running standard deviation of the discounted return of N parallel environments.

    Source: the reward scaling of Engstrom et al. (2020), arXiv:2005.12729, section 3.
    """

    def __init__(self, n_envs: int, gamma: float) -> None:
        self.gamma = gamma
        self._returns = np.zeros(n_envs)
        self._count, self._mean, self._squares = 0.0, 0.0, 0.0

    @property
    def std(self) -> float:
        """Standard deviation of every discounted return seen; 1 before there are two."""
        if self._count < 2 or self._squares <= 0.0:
            return 1.0
        return float(np.sqrt(self._squares / self._count))

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
