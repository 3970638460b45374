"""A small task with a known expert: go to the origin of a plane.

    x' = clip(x + 0.06 a, +-1.5),   reward = -|x|,   30 steps

Staying alive pays nothing, so a reward that only rewards survival teaches nothing. `Cliff-v0` is the same
but ends the episode where |x_1| > 1, and `NaNReward-v0` is the same with a reward of NaN, `NaNLater-v0`
from its 700th step on. The actions of `Far-v0` are around 15.
"""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.spaces import Box

from irl.core.types import Episode
from irl.envs.rollouts import rollouts
from irl.policies.policy import Policy, PolicySpec

STEPS = 30


class PointMass(gym.Env):
    """The task of this module; every reset draws a start in [-1, 1]^2."""

    def __init__(
        self, cliff: float = np.inf, reward: float | None = None, good: int = 0, middle: float = 0.0
    ) -> None:
        self.observation_space = Box(-1.5, 1.5, (2,), np.float64)
        self.action_space = Box(middle - 1.0, middle + 1.0, (2,), np.float32)
        self._cliff, self._reward, self._middle = cliff, reward, middle
        self._good = good

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        super().reset(seed=seed)
        self._x = self.np_random.uniform(-0.9, 0.9, 2)
        return self._x.copy(), {}

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict]:
        # noise in the step, so that a replay that forgets the generator is caught
        pushed = np.asarray(action, dtype=np.float64) - self._middle
        push = 0.06 * pushed + self.np_random.normal(0.0, 0.01, 2)
        self._x = np.clip(self._x + push, -1.5, 1.5)
        by_hand = self._reward is None or self._good > 0
        self._good -= 1
        reward = -float(np.linalg.norm(self._x)) if by_hand else float(self._reward or 0.0)
        return self._x.copy(), reward, bool(abs(self._x[0]) > self._cliff), False, {}


def _register(env_id: str, **kwargs: float) -> None:
    if env_id not in gym.registry:
        # by name, so that a dataset can record how to make it
        entry = "tests.pointmass:PointMass"
        gym.register(env_id, entry, max_episode_steps=STEPS, kwargs=kwargs, disable_env_checker=True)


_register("PointMass-v0")
_register("Cliff-v0", cliff=1.0)
_register("NaNReward-v0", reward=float("nan"))
_register("NaNLater-v0", reward=float("nan"), good=700)
_register("NoReward-v0", reward=0.0)
_register("Far-v0", middle=15.0)


def expert(env_id: str = "PointMass-v0") -> Policy:
    """a = clip(-5 x): to the origin as fast as the bounds allow."""
    weights = {
        "layers.0.weight": -5.0 * np.eye(2),
        "layers.0.bias": np.zeros(2),
        "log_std": np.full(2, -2.0),
        "obs_mean": np.zeros(2),
        "obs_std": np.ones(2),
        "action_low": -np.ones(2),
        "action_high": np.ones(2),
    }
    return Policy(PolicySpec(env_id, 2, 2, (), "tanh", "gaussian"), weights)


def demonstrations(n: int, env_id: str = "PointMass-v0") -> list[Episode]:
    """Episodes of the expert, the same every time."""
    return rollouts(env_id, expert(env_id), range(n))
