"""A wrapper that can say where an environment is, and bring a fresh one there.

A simulator's visible state is not all of it (MuJoCo keeps warm-start forces, wrappers keep counters),
so the state is told as its cause: the generator before the last reset, that reset's seed, and the
actions since. Restoring replays them.
"""

from typing import Any

import gymnasium as gym
import numpy as np

from irl.core.errors import UserError

SAME = 1e-6
"""Observations may differ by this, by their rounding to float32 among others."""


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

    def restore(self, position: dict[str, Any]) -> Any:
        """Bring a fresh environment to where another one was; what is observed there. Cost: its steps.

        Nothing but the environment's `np_random` is brought back: see `check_restored`.
        """
        self.unwrapped.np_random.bit_generator.state = position["generator"]
        obs, _ = self.reset(seed=position["seed"])
        for action in position["actions"]:
            obs = self.step(action)[0]
        return obs

    def check_restored(self, position: dict[str, Any], obs: np.ndarray, expected: np.ndarray) -> None:
        """Refuse to go on where a replay, which gave `obs`, is by chance elsewhere than the episode was.

        Another processor rounds in its own way, and a body that runs is soon somewhere else by that: it is
        there again in another replay, which one that follows a generator out of reach is not.

        Raises:
            UserError: two replays differ, and neither was `expected`.
        """
        if _same(obs, expected) or _same(self.restore(position), obs):
            return
        spec = self.unwrapped.spec
        raise UserError(
            f"{spec.id if spec else type(self.unwrapped).__name__} was replayed to where it was left, and "
            f"two replays differ: it draws from a generator other than its np_random, so what was begun in "
            f"it cannot go on; let it draw from self.np_random, which super().reset(seed=seed) seeds, and "
            f"begin again"
        )


def _same(a: Any, b: Any) -> bool:
    return bool(np.allclose(np.asarray(a), np.asarray(b), rtol=SAME, atol=SAME))
