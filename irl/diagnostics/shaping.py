"""The regression behind `irl.diagnostics.terms`: a reward on terms and on what a potential adds to a step."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from irl.core.nets import CLIP, MIN_STD
from irl.core.statistics import is_constant
from irl.core.types import Episode

MOST_SQUARED = 64
"""Observations of more numbers than this enter a potential without their squares."""


def column_of(episodes: Sequence[Episode], name: str) -> Float[np.ndarray, "N"]:
    """A term on every step of all episodes, in their order."""
    return np.concatenate([episode.terms[name] for episode in episodes])


def moments(episodes: Sequence[Episode]) -> tuple[Float[np.ndarray, "O"], Float[np.ndarray, "O"]]:
    """Mean and deviation of the observations; 1 where they do not vary."""
    obs = np.concatenate([episode.obs for episode in episodes])
    std = obs.std(0)
    return obs.mean(0), np.where(std > MIN_STD, std, 1.0)


def potential_parts(obs: Float[np.ndarray, "T O"], mean: np.ndarray, std: np.ndarray) -> np.ndarray:
    """What a potential is made of; squares only where there are few."""
    z = np.clip((obs - mean) / std, -CLIP, CLIP)
    return np.column_stack([z, z**2]) if obs.shape[1] <= MOST_SQUARED else z


def design(
    episode: Episode, names: Sequence[str], gamma: float, mean: np.ndarray, std: np.ndarray
) -> Float[np.ndarray, "T Q"]:
    """A one, the terms, and what each part of the potential adds to a step."""
    phi = potential_parts(episode.obs, mean, std)
    after = gamma * phi[1:]
    if episode.terminated:
        after[-1] = 0.0
    terms = [episode.terms[name] for name in names]
    return np.column_stack([np.ones(len(episode)), *terms, after - phi[:-1]])


def alive_value(episodes: Sequence[Episode], name: str) -> float | None:
    """What a term pays on every step that does not end the episode, if it pays nothing on those that do."""
    alive = np.concatenate([_alive(episode) for episode in episodes])
    values = column_of(episodes, name)
    if alive.all() or not is_constant(values[alive]) or np.abs(values[~alive]).max() > 0.0:
        return None
    return float(values[alive][0])


def _alive(episode: Episode) -> np.ndarray:
    alive = np.ones(len(episode), dtype=bool)
    alive[-1] = not episode.terminated
    return alive
