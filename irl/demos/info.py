"""What a dataset is, in numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from irl.demos.storage import open_dataset, read_episodes


@dataclass(frozen=True)
class DemosInfo:
    """One dataset. Returns are undiscounted, their standard deviation is over episodes."""

    dataset_id: str
    env_id: str | None
    path: Path
    episodes: int
    steps: int
    return_mean: float
    return_std: float
    length_min: int
    length_max: int
    terms: tuple[str, ...]
    """Names of the reward terms that every step has."""
    infos: tuple[str, ...]
    """Other numbers that every step has, by `info` key."""
    seeds: tuple[int | None, ...]
    """What the environment was reset with, an episode."""
    size_bytes: int
    algorithm: str | None
    author: str | None
    description: str | None
    random_return: float | None
    expert_return: float | None


def show(dataset_id: str, root: Path | str | None = None) -> DemosInfo:
    """What the dataset holds; reads all of it.

    Raises:
        UserError: not a dataset id, not there, empty or not readable.
    """
    dataset = open_dataset(dataset_id, root)
    episodes = read_episodes(dataset, root)
    returns, lengths = [e.return_ for e in episodes], [len(e) for e in episodes]
    return DemosInfo(
        dataset_id=dataset_id,
        env_id=dataset.env_id,
        path=dataset.path,
        episodes=len(episodes),
        steps=sum(lengths),
        return_mean=float(np.mean(returns)),
        return_std=float(np.std(returns)),
        length_min=min(lengths),
        length_max=max(lengths),
        terms=_shared([e.terms for e in episodes]),
        infos=_shared([e.infos for e in episodes]),
        seeds=tuple(e.seed for e in episodes),
        size_bytes=sum(file.stat().st_size for file in dataset.path.rglob("*") if file.is_file()),
        algorithm=dataset.algorithm,
        author=dataset.author,
        description=dataset.description,
        random_return=dataset.random_return,
        expert_return=dataset.expert_return,
    )


def _shared(columns: Sequence[Mapping[str, object]]) -> tuple[str, ...]:
    return tuple(key for key in columns[0] if all(key in others for others in columns))
