"""Tasks with a choice of actions, as everything outside the learners sees them: one action, one row.

    choice i of n  <->  (0, ..., 1, ..., 0), the one at place i

A row of numbers is what `Transitions`, discriminators and rewards hold; the environment itself, datasets
and Stable-Baselines3 have the choice.
"""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Discrete
from jaxtyping import Float, Integer


class OneHot(Box):
    """The rows that stand for the choices of a `Discrete` space."""

    def __init__(self, choices: Discrete) -> None:
        super().__init__(0.0, 1.0, (int(choices.n),), np.float32)
        self.choices = choices

    def __repr__(self) -> str:
        return f"OneHot({self.choices})"

    def rows(self, chosen: Integer[np.ndarray, "T"]) -> Float[np.ndarray, "T A"]:
        """A row for each choice.

        Raises:
            ValueError: a choice is none of the space's; names its place.
        """
        places = chosen.astype(np.int64) - int(self.choices.start)
        outside = (places < 0) | (places >= self.choices.n)
        if outside.any():
            step = int(np.argmax(outside))
            raise ValueError(
                f"the action {chosen[step]} at step {step} is none of {self.choices.start} to "
                f"{self.choices.start + self.choices.n - 1}"
            )
        return np.eye(int(self.choices.n), dtype=np.float32)[places]

    def chosen(self, rows: Float[np.ndarray, "*T A"]) -> Integer[np.ndarray, "*T"]:
        """The choice that each row stands for: where it is largest."""
        return np.asarray(np.argmax(rows, axis=-1) + int(self.choices.start))

    def row(self, wanted: np.ndarray) -> np.ndarray:
        """The row that a policy's answer comes to: a choice, or numbers of which the largest counts.

        Rows of numbers that are not finite come back as they are, for whoever checks them.

        Raises:
            ValueError: the answer is a single number that is no choice of the space.
        """
        if wanted.shape == ():
            # not cut to one: a policy for numbers would be taken for one that always chooses the first
            if not float(wanted).is_integer():
                raise ValueError(
                    f"expected a choice of {self.choices}, a whole number, or a row of {self.choices.n} "
                    f"numbers; the policy gave {wanted}"
                )
            return self.rows(wanted.reshape(1).astype(np.int64))[0]
        if wanted.shape != self.shape or not np.isfinite(wanted).all():
            return wanted
        return np.eye(len(wanted), dtype=np.float32)[np.argmax(wanted)]


class OneHotActions(gym.Wrapper):
    """An environment with a `Discrete` action space that takes rows."""

    def __init__(self, env: gym.Env) -> None:
        super().__init__(env)
        assert isinstance(env.action_space, Discrete)
        self._rows = OneHot(env.action_space)
        self.action_space = self._rows

    @property
    def spec(self) -> EnvSpec | None:
        """That of the environment inside."""
        return self.env.spec

    def step(self, action: np.ndarray) -> tuple[Any, Any, bool, bool, dict]:
        """One step with the choice that the row stands for."""
        return self.env.step(int(self._rows.chosen(np.asarray(action))))
