"""What a dataset is, in numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.table import Table
from rich.text import Text

from irl.demos.recording import Recorded
from irl.demos.storage import open_dataset, read_episodes
from irl.envs.flatten import part_names


@dataclass(frozen=True)
class DemosInfo:
    """One dataset. Returns are undiscounted, their standard deviation is over episodes.

    They are NaN where rewards were not recorded.
    """

    dataset_id: str
    env_id: str | None
    env_name: str | None
    """The task's full name: the id with the arguments that make it a variant."""
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
    action_size: int
    """Numbers of an action; 0 where no actions were recorded."""
    size_bytes: int
    algorithm: str | None
    author: str | None
    description: str | None
    random_return: float | None
    expert_return: float | None
    recorded: Recorded | None
    """How a policy's episodes were made, and which were dropped."""


def show(dataset_id: str, root: Path | str | None = None, obs_keys: Sequence[str] = ()) -> DemosInfo:
    """What the dataset holds; reads all of it.

    Args:
        obs_keys: parts of observations in a dictionary that are put in a row, in this order.

    Raises:
        UserError: not a dataset id, not there, empty or not readable.
    """
    dataset = open_dataset(dataset_id, root, part_names(obs_keys))
    episodes = read_episodes(dataset, root)
    returns, lengths = [e.return_ for e in episodes], [len(e) for e in episodes]
    return DemosInfo(
        dataset_id=dataset_id,
        env_id=dataset.env_id,
        env_name=dataset.env_name,
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
        action_size=episodes[0].action.shape[1],
        size_bytes=sum(file.stat().st_size for file in dataset.path.rglob("*") if file.is_file()),
        algorithm=dataset.algorithm,
        author=dataset.author,
        description=dataset.description,
        random_return=dataset.random_return,
        expert_return=dataset.expert_return,
        recorded=dataset.recorded,
    )


def _shared(columns: Sequence[Mapping[str, object]]) -> tuple[str, ...]:
    return tuple(key for key in columns[0] if all(key in others for others in columns))


def table(info: DemosInfo) -> Table:
    """The dataset for a person to read."""
    found = Table(show_header=False, title=info.dataset_id)
    paid = f"{info.return_mean:.1f} ± {info.return_std:.1f}"
    rows = {
        "task": info.env_name or "unknown",
        "episodes": f"{info.episodes} of {info.length_min} to {info.length_max} steps, {info.steps:,} in all",
        "return": "not recorded" if np.isnan(info.return_mean) else paid,
        "reference returns": f"random {_number(info.random_return)}, expert {_number(info.expert_return)}",
        "actions": f"{info.action_size} numbers" if info.action_size else "none recorded",
        "reward terms": ", ".join(info.terms) or "none recorded",
        "also recorded": ", ".join(info.infos) or "nothing",
        "made by": info.algorithm or "unknown",
        **({"played": info.recorded.words} if info.recorded is not None else {}),
        "size": f"{info.size_bytes / 1e6:.1f} MB",
        "folder": str(info.path),
    }
    for name, value in rows.items():
        # what a file says is neither markup, nor for the terminal to obey
        found.add_row(name, Text("".join(c if c.isprintable() else "?" for c in value)))
    return found


def _number(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.1f}"
