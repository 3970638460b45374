"""The point mass, with one thing wrong."""

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec

from tests.experiment.conftest import TASK
from tests.pointmass import STEPS, PointMass

BAD_STEP = 12


class Faulty(PointMass):
    """Does `at_reset` to the first observation of an episode and `at_step` to that of step 12."""

    def __init__(self, at_reset: Callable = lambda obs: obs, at_step: Callable = lambda obs: obs) -> None:
        super().__init__()
        self._at_reset, self._at_step, self._steps = at_reset, at_step, 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        obs, info = super().reset(seed=seed, options=options)
        self._steps = 0
        return self._at_reset(obs), info

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict]:
        obs, reward, terminated, truncated, info = super().step(action)
        self._steps += 1
        obs = self._at_step(obs) if self._steps == BAD_STEP + 1 else obs
        return obs, reward, terminated, truncated, info


def crash(obs: np.ndarray) -> np.ndarray:
    raise ZeroDivisionError("a bug\nof two lines")


def nan(obs: np.ndarray) -> np.ndarray:
    return np.array([obs[0], np.nan])


def short(obs: np.ndarray) -> np.ndarray:
    return obs[:1]


def _with(**changes: gym.Space) -> Callable[[], gym.Env]:
    def build() -> gym.Env:
        env = PointMass()
        for name, space in changes.items():
            setattr(env, name, space)
        return env

    return build


def _fails() -> gym.Env:
    raise FileNotFoundError("no model.xml")


_BOX = spaces.Box(-1.0, 1.0, (2,))
FAULTY: dict[str, Callable[[], gym.Env]] = {
    "raises when made": _fails,
    "raises at reset": lambda: Faulty(at_reset=crash),
    "raises at a step": lambda: Faulty(at_step=crash),
    "nan at reset": lambda: Faulty(at_reset=nan),
    "nan at a step": lambda: Faulty(at_step=nan),
    "another shape": lambda: Faulty(at_step=short),
    "pays nan": lambda: PointMass(reward=float("nan")),
    "dict observations": _with(observation_space=spaces.Dict({"x": _BOX})),
    "tuple observations": _with(observation_space=spaces.Tuple((_BOX, _BOX))),
    "image observations": _with(observation_space=spaces.Box(0, 255, (8, 8, 3), np.uint8)),
    "byte observations": _with(observation_space=spaces.Box(0, 255, (128,), np.uint8)),
    "discrete observations": _with(observation_space=spaces.Discrete(4)),
    "discrete actions": _with(action_space=spaces.Discrete(4)),
    "several choices": _with(action_space=spaces.MultiDiscrete([2, 3])),
    "dict actions": _with(action_space=spaces.Dict({"x": _BOX})),
    "unbounded actions": _with(action_space=spaces.Box(-np.inf, np.inf, (2,))),
}


def spec(fault: str) -> EnvSpec:
    """What to register in place of the point mass."""
    return EnvSpec(TASK, lambda **_: FAULTY[fault](), max_episode_steps=STEPS, disable_env_checker=True)
