"""Observations in a dictionary as one row: the named parts, in the order they are named."""

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Dict
from jaxtyping import Float

from irl.core.errors import UserError
from irl.envs.names import OBS_KEYS


def part_names(given: object) -> tuple[str, ...]:
    """The names that `obs_keys` gives: a list of them, or one.

    Raises:
        UserError: it is neither.
    """
    names = (given,) if isinstance(given, str) else given
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise UserError(_no_names(given))
    return tuple(names)


def _no_names(given: object) -> str:
    return (
        f"obs_keys is {given!r:.60}; expected names of the parts, e.g. --env-kwargs "
        f'\'{{"{OBS_KEYS}": ["observation"]}}\''
    )


def flat_space(owner: str, space: gym.Space, keys: Sequence[str]) -> Box:
    """The space of the rows.

    Raises:
        UserError: `space` is no Dict, no part is named, there is none of a name, or one is no Box of real
            numbers.
    """
    if not keys:
        raise UserError(_no_names(list(keys)))
    if not isinstance(space, Dict):
        shown = " ".join(str(space).split())
        raise UserError(f"{owner} has the observations {shown:.120}; obs_keys is for those in a Dict")
    parts = []
    for key in keys:
        part = space.spaces.get(key)
        if not isinstance(part, Box) or not np.issubdtype(part.dtype, np.floating):
            known = ", ".join(map(str, space.spaces))
            raise UserError(
                f"{owner} has no real numbers {key!r:.40} in its observations; obs_keys takes: {known:.200}"
            )
        parts.append(part)
    if len(set(keys)) < len(keys):
        raise UserError(f"obs_keys names a part twice: {', '.join(keys)}")
    dtype = np.result_type(*(part.dtype for part in parts))
    low, high = (np.concatenate([getattr(p, end).ravel() for p in parts]) for end in ("low", "high"))
    return Box(low.astype(dtype), high.astype(dtype), dtype=dtype.type)


def flat_rows(parts: Sequence[np.ndarray]) -> Float[np.ndarray, "T O"]:
    """T rows of the parts, each of T rows itself."""
    return np.concatenate(
        [np.asarray(part, dtype=np.float64).reshape(len(part), -1) for part in parts], axis=1
    )


class FlatKeys(gym.ObservationWrapper):
    """An environment whose observations are the named parts of its dictionary, in one row."""

    def __init__(self, env: gym.Env, owner: str, keys: Sequence[str]) -> None:
        super().__init__(env)
        self._keys = tuple(keys)
        self.observation_space = flat_space(owner, env.observation_space, self._keys)

    @property
    def spec(self) -> EnvSpec | None:
        """That of the environment inside, and the parts: a dataset names the task by it."""
        if (inner := self.env.spec) is None:
            return None
        spec = copy(inner)
        spec.kwargs = {**inner.kwargs, OBS_KEYS: list(self._keys)}
        return spec

    def observation(self, observation: Mapping[str, Any]) -> np.ndarray:
        """The row."""
        row = np.concatenate([np.asarray(observation[key]).ravel() for key in self._keys])
        return row.astype(self.observation_space.dtype)
