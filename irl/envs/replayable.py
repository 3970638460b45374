"""A wrapper that can say where an environment is, and bring a fresh one there.

A simulator's visible state is not all of it (MuJoCo keeps warm-start forces, wrappers keep counters),
so the state is told as its cause: the generator before the last reset, that reset's seed, and the
actions since. Restoring replays them.
"""

from typing import Any

import gymnasium as gym
import numpy as np


class Replayable(gym.Wrapper):
    """Records what led here since the last reset. Cost: one array copy a step."""

    def __init__(self, env: gym.Env) -> None:
        super().__init__(env)
        self._generator: dict[str, Any] | None = None
        self._seed: int | None = None
        self._actions: list[np.ndarray] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        """Start an episode, as the environment does."""
        self._generator = dict(self.unwrapped.np_random.bit_generator.state)
        self._seed = seed
        self._actions = []
        return self.env.reset(seed=seed, options=options)

    def step(self, action: np.ndarray) -> tuple[Any, Any, bool, bool, dict]:
        """One step, as the environment does it."""
        self.note(np.array(action, copy=True))
        return self.env.step(action)

    def note(self, action: np.ndarray) -> int:
        """Record an action that the caller takes by itself (`irl.envs.planar`); which step it is, from 1 on.

        The array is kept: nobody may write to it afterwards.
        """
        self._actions.append(action)
        return len(self._actions)

    def position(self) -> dict[str, Any]:
        """Everything `restore` needs; plain values and arrays.

        Raises:
            RuntimeError: the environment was never reset.
        """
        if self._generator is None:
            raise RuntimeError("reset the environment before asking for its position")
        return {"generator": self._generator, "seed": self._seed, "actions": list(self._actions)}

    def restore(self, position: dict[str, Any]) -> None:
        """Bring a fresh environment to where another one was. Cost: the steps of one episode."""
        self.unwrapped.np_random.bit_generator.state = position["generator"]
        self.reset(seed=position["seed"])
        for action in position["actions"]:
            self.step(action)
