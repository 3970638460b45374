"""Minari's datasets on disk: their ids, and their episodes as ours."""

import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from jaxtyping import Float
from minari import EpisodeData, MinariDataset
from minari.dataset.minari_dataset import parse_dataset_id

from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos.root import datasets_root, minari_at
from irl.envs.tasks import TASKS, Task, task_of


def list_datasets(root: Path | str | None = None) -> list[str]:
    """Ids of the datasets in a root, sorted; none where the root does not exist."""
    folder = datasets_root(root)
    found = [path.parent.parent.relative_to(folder) for path in folder.glob("**/data/metadata.json")]
    # hidden folders hold what is being written
    return sorted(path.as_posix() for path in found if not any(part.startswith(".") for part in path.parts))


def check_id(dataset_id: str) -> None:
    """Refuse what Minari does not take for a dataset id.

    Raises:
        UserError: it is not of the form `folder/name-v0`.
    """
    try:
        parse_dataset_id(dataset_id)
    except (ValueError, TypeError):  # TypeError: without a version
        valid = False
    else:
        valid = "//" not in dataset_id
    if not valid:
        raise UserError(
            f"{dataset_id!r} is not a dataset id; expected folders and a name of letters, digits, _ and -, "
            "and a version, e.g. irl/hopper/expert-v0"
        )


def generate_command(dataset_id: str, root: Path | str | None = None) -> str:
    """What to type to make the dataset; the environment is guessed from the folders of the id."""
    parts = dataset_id.split("/")
    env_id = next((task.env_id for task in TASKS if task.name in parts), "ENV_ID")
    where = "" if root is None else f" --datasets-root {shlex.quote(str(root))}"
    return f"irl demos generate --env-id {env_id} --dataset-id {dataset_id}{where}"


def open_dataset(dataset_id: str, root: Path | str | None = None) -> MinariDataset:
    """Minari's dataset of that id.

    Raises:
        UserError: not a dataset id; not there (says what is, and how to make it); not readable.
    """
    check_id(dataset_id)
    folder = datasets_root(root)
    data = folder / dataset_id / "data"
    if not data.is_dir():
        there = ", ".join(list_datasets(folder)) or "none"
        raise UserError(
            f"no dataset {dataset_id!r} in {folder}; there: {there}; make it with "
            f"`{generate_command(dataset_id, root)}`"
        )
    try:
        with minari_at(folder):
            return MinariDataset(data)
    except (ValueError, LookupError, TypeError, AssertionError, OSError) as error:
        raise _unreadable(dataset_id, data, error) from error


def env_id_of(dataset: MinariDataset) -> str | None:
    """The environment that the dataset was recorded in, where it says so."""
    return dataset.env_spec.id if dataset.env_spec is not None else None


def read_episodes(dataset: MinariDataset) -> list[Episode]:
    """Every episode of the dataset, in its order.

    A step's row of `infos` is what the environment said after the step; the row of the reset, which Minari
    keeps first, is left out. Where every term of the task was recorded, they are the episode's terms.

    Raises:
        UserError: observations or actions are not flat Boxes, or the files are damaged.
    """
    path = Path(str(dataset.storage.data_path))
    for what, space in (("observations", dataset.observation_space), ("actions", dataset.action_space)):
        if not isinstance(space, Box) or len(space.shape) != 1:
            raise UserError(f"dataset {dataset.id} has the {what} {space}; expected a flat Box")
    env_id = env_id_of(dataset)
    task = task_of(env_id) if env_id is not None else None
    try:
        seeds = [m.get("seed") for m in _metadata(dataset)]
        return [_episode(data, seed, task) for data, seed in zip(_data(dataset), seeds, strict=True)]
    except (ValueError, LookupError, TypeError, AssertionError, OSError) as error:
        raise _unreadable(dataset.id, path, error) from error


def _metadata(dataset: MinariDataset) -> Iterable[Mapping[str, Any]]:
    return dataset.storage.get_episode_metadata(dataset.episode_indices.tolist())


def _data(dataset: MinariDataset) -> Iterable[EpisodeData]:
    return dataset.iterate_episodes(dataset.episode_indices.tolist())


def _episode(data: EpisodeData, seed: int | None, task: Task | None) -> Episode:
    columns = _columns(data.infos or {}, len(data.rewards))
    terms: Mapping[str, str] = {}
    if task is not None and all(key in columns for key in task.terms):
        terms = task.terms
    terminated = bool(data.terminations[-1])
    return Episode(
        obs=np.asarray(data.observations, dtype=np.float64),
        action=np.asarray(data.actions),
        reward=np.asarray(data.rewards, dtype=np.float64),
        terminated=terminated,
        # an episode that nothing ended was cut off by the recording
        truncated=bool(data.truncations[-1]) or not terminated,
        terms={name: columns[key] for key, name in terms.items()},
        infos={key: values for key, values in columns.items() if key not in terms},
        seed=seed,
    )


def _columns(infos: Mapping[str, Any], steps: int) -> dict[str, Float[np.ndarray, "T"]]:
    """The infos that are one number a step; other recorders leave out the row of the reset."""
    rows = {
        key: values for key, values in infos.items() if isinstance(values, np.ndarray) and values.ndim == 1
    }
    return {
        key: values[-steps:].astype(np.float64)
        for key, values in rows.items()
        if len(values) in (steps, steps + 1) and values.dtype.kind in "biuf"
    }


def _unreadable(dataset_id: str, path: Path, error: BaseException) -> UserError:
    return UserError(f"dataset {dataset_id} in {path} cannot be read: {' '.join(str(error).split())}")
