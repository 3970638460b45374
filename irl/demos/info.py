"""What a dataset is, in numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from irl.core.errors import UserError
from irl.demos.storage import env_id_of, open_dataset, read_episodes


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
    metadata = dataset.storage.metadata
    data = Path(str(dataset.storage.data_path))
    episodes = read_episodes(dataset)
    if not episodes:
        raise UserError(f"dataset {dataset_id} in {data} has no episode")
    returns, lengths = [e.return_ for e in episodes], [len(e) for e in episodes]
    return DemosInfo(
        dataset_id=dataset_id,
        env_id=env_id_of(dataset),
        path=data.parent,
        episodes=len(episodes),
        steps=sum(lengths),
        return_mean=float(np.mean(returns)),
        return_std=float(np.std(returns)),
        length_min=min(lengths),
        length_max=max(lengths),
        terms=_shared([e.terms for e in episodes]),
        infos=_shared([e.infos for e in episodes]),
        seeds=tuple(e.seed for e in episodes),
        size_bytes=sum(file.stat().st_size for file in data.rglob("*") if file.is_file()),
        algorithm=metadata.get("algorithm_name"),
        author=", ".join(sorted(metadata.get("author", ()))) or None,
        description=metadata.get("description"),
        random_return=metadata.get("ref_min_score"),
        expert_return=metadata.get("ref_max_score"),
    )


def _shared(columns: Sequence[Mapping[str, object]]) -> tuple[str, ...]:
    return tuple(key for key in columns[0] if all(key in others for others in columns))
