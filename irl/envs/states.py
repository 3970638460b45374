"""The simulator's state beside each recorded step: what an observation hides of it."""

from typing import Any

import gymnasium as gym
import numpy as np
from jaxtyping import Float


class StateRecorder(gym.Wrapper):
    """Notes qpos and qvel of the state that each step starts from; nothing where there is no MuJoCo."""

    def __init__(self, env: gym.Env) -> None:
        super().__init__(env)
        self._states: list[tuple[np.ndarray, np.ndarray]] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        """Start an episode, and its notes anew."""
        self._states = []
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict]:
        data = getattr(self.env.unwrapped, "data", None)
        if data is not None and hasattr(data, "qpos") and hasattr(data, "qvel"):
            self._states.append((np.array(data.qpos), np.array(data.qvel)))
        return self.env.step(action)

    def columns(self) -> dict[str, Float[np.ndarray, "T"]]:
        """By name `qpos_0`, `qpos_1`, ..., `qvel_0`, ..., of this episode so far."""
        if not self._states:
            return {}
        qpos, qvel = zip(*self._states, strict=True)
        parts = {"qpos": np.array(qpos), "qvel": np.array(qvel)}
        return {f"{name}_{i}": rows[:, i] for name, rows in parts.items() for i in range(rows.shape[1])}
