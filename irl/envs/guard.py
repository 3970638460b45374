"""What an environment does wrong, said in one line: which one, when, and what it did."""

from numbers import Real
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec

from irl.core.errors import UserError


class Guarded(gym.Wrapper):
    """Refuses an environment that raises, or whose observations are not finite numbers of its own shape.

    A reward has to be one number; which, whoever needs it says. Cost: 2 microseconds a step.
    """

    def __init__(self, env: gym.Env, env_id: str) -> None:
        super().__init__(env)
        self._id, self._seed, self._steps = env_id, None, 0
        self._shape = env.observation_space.shape

    @property
    def spec(self) -> EnvSpec | None:
        """That of the environment inside: a dataset names how to make the task, not who watched it."""
        return self.env.spec

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        """Start an episode.

        Raises:
            UserError: the environment raised, or its first observation is not usable.
        """
        self._seed, self._steps = seed, 0
        try:
            obs, info = self.env.reset(seed=seed, options=options)
        except Exception as error:
            raise self._raised("reset", error) from error
        self._check(obs, "at its reset")
        return obs, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict]:
        """One step.

        Raises:
            UserError: the environment raised, or the observation after the step is not usable.
        """
        try:
            obs, reward, terminated, truncated, info = self.env.step(action)
        except Exception as error:
            raise self._raised("step", error, action) from error
        if not isinstance(reward, Real) and (shape := np.shape(np.asarray(reward))):
            raise UserError(
                f"{self._id} gave a reward of shape {shape} after step {self._steps}{self._of_seed()}; "
                f"expected one number: mend the environment, e.g. reward[0]"
            )
        self.check(obs, self._steps, action)
        self._steps += 1
        return obs, reward, terminated, truncated, info

    def check(self, obs: Any, step: int, action: Any) -> None:
        """Refuse an unusable observation after that step, the first of an episode being 0.

        Raises:
            UserError: says which number is wrong.
        """
        self._check(obs, f"after step {step}", action)

    def _check(self, obs: Any, when: str, action: Any = None) -> None:
        shape = np.shape(obs)
        if shape != self._shape:
            raise UserError(
                f"{self._id} gave an observation of shape {shape} {when}{self._of_seed()}; its own space "
                f"says {self._shape}"
            )
        if not np.isfinite(obs).all():
            column = int(np.argmin(np.isfinite(obs)))
            raise UserError(
                f"{self._id} gave an observation with {obs[column]} in column {column} {when}"
                f"{self._of_seed()}{_not_finite(action)}; expected finite numbers: mend the environment"
            )

    def _raised(self, what: str, error: Exception, action: Any = None) -> UserError:
        when = f" {self._steps}" if what == "step" else ""
        return UserError(
            f"the {what}{when} of {self._id}{self._of_seed()} raised {type(error).__name__}: {error}"
            f"{_not_finite(action)}; mend the environment; --debug shows where"
        )

    def _of_seed(self) -> str:
        return "" if self._seed is None else f" (seed {self._seed})"


def _not_finite(action: Any) -> str:
    """A word on the action where it, not the environment, may be the cause."""
    if action is None or np.isfinite(action).all():
        return ""
    return f", having been given the action {action}"
