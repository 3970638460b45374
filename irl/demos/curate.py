"""Datasets out of datasets: several as one, or one as two."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gymnasium.spaces import Discrete

from irl.core.errors import UserError
from irl.core.rng import stream
from irl.core.types import Episode
from irl.demos.info import DemosInfo, show
from irl.demos.metadata import Dataset
from irl.demos.recording import together
from irl.demos.storage import open_dataset, read_episodes
from irl.demos.write import Labels, Origin, check_target, write
from irl.envs.discrete import OneHot
from irl.envs.flatten import part_names
from irl.envs.names import OBS_KEYS


def merge(
    dataset_ids: Sequence[str],
    into: str,
    *,
    root: Path | str | None = None,
    obs_keys: Sequence[str] = (),
    overwrite: bool = False,
) -> DemosInfo:
    """All episodes of the datasets, in order, as a new one.

    Reference returns stay where all have the same.

    Args:
        obs_keys: parts of observations in a dictionary, which the new dataset has in a row, in this order.

    Raises:
        UserError: fewer than two, one is given twice, or they are of different tasks or spaces.
    """
    if len(set(dataset_ids)) < max(len(dataset_ids), 2):
        raise UserError(f"{len(dataset_ids)} datasets to merge; expected two or more, each once")
    target = check_target(into, root, overwrite)
    datasets = [open_dataset(name, root, part_names(obs_keys)) for name in dataset_ids]
    first = datasets[0]
    for other in datasets[1:]:
        # another reward or other dynamics are arguments of the same id
        for what, word in (
            ("env_name", "task"),
            ("obs_space", "obs_space"),
            ("action_space", "action_space"),
        ):
            a, b = getattr(first, what), getattr(other, what)
            if a != b:
                raise UserError(
                    f"{first.dataset_id} has the {word} {a}, {other.dataset_id} has {b}; merge datasets of "
                    f"one task"
                )
    episodes = [episode for dataset in datasets for episode in read_episodes(dataset, root)]
    labels = Labels(
        _same([d.algorithm for d in datasets]) or "several",
        ", ".join(dict.fromkeys(d.author for d in datasets if d.author)) or None,
        f"merged of {', '.join(dataset_ids)}",
        _same([d.random_return for d in datasets]),
        _same([d.expert_return for d in datasets]),
        together([d.recorded for d in datasets]),
    )
    write(target, into, root, episodes, _origin(first), labels)
    return show(into, root)


def split(
    dataset_id: str,
    into: tuple[str, str],
    *,
    held_out: float,
    seed: int,
    root: Path | str | None = None,
    obs_keys: Sequence[str] = (),
    overwrite: bool = False,
) -> tuple[DemosInfo, DemosInfo]:
    """The episodes in two new datasets: to learn from, and a share of `held_out` drawn with `seed`.

    At least one episode goes to each side; with one seed a smaller share is a subset of a larger one.

    Args:
        obs_keys: parts of observations in a dictionary, which the new datasets have in a row, in this order.

    Raises:
        UserError: there is only one episode, or the names are the same.
    """
    if into[0] == into[1]:
        raise UserError(f"both parts would be called {into[0]!r}; choose two names")
    targets = [check_target(name, root, overwrite) for name in into]
    dataset = open_dataset(dataset_id, root, part_names(obs_keys))
    if (n := dataset.episodes) < 2:
        raise UserError(f"{dataset_id} has {n} episodes; expected at least 2 to split")
    episodes = read_episodes(dataset, root)
    away = min(max(round(held_out * n), 1), n - 1)
    drawn = stream(seed, "held-out episodes").permutation(n)
    parts = sorted(drawn[away:].tolist()), sorted(drawn[:away].tolist())
    for name, target, part in zip(into, targets, parts, strict=True):
        words = f"episodes {', '.join(map(str, part))} of {dataset_id}"
        _write_part(dataset, [episodes[i] for i in part], name, target, root, words)
    return show(into[0], root), show(into[1], root)


def _write_part(
    dataset: Dataset, part: list[Episode], name: str, target: Path, root: Path | str | None, words: str
) -> None:
    returns = dataset.random_return, dataset.expert_return
    labels = Labels(dataset.algorithm, dataset.author, words, *returns, dataset.recorded)
    write(target, name, root, part, _origin(dataset), labels)


def _origin(dataset: Dataset) -> Origin:
    space = dataset.action_space
    action_space = OneHot(space) if isinstance(space, Discrete) else space
    return Origin(dataset.obs_space, action_space, dataset.env_id, _spec(dataset))


def _spec(dataset: Dataset) -> str | None:
    """What it says of its environment, with the parts of the observations that are in a row from here on."""
    if dataset.env_spec is None or not dataset.obs_keys:
        return dataset.env_spec
    content = json.loads(dataset.env_spec)
    return json.dumps(content | {"kwargs": content.get("kwargs", {}) | {OBS_KEYS: list(dataset.obs_keys)}})


def _same(values: list[Any]) -> Any:
    return values[0] if all(value == values[0] for value in values) else None
