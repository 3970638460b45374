"""Minari's datasets on disk: their ids, what their metadata say, and their episodes as ours.

The files are read here and not by Minari, which would run what a dataset names: without its spaces it
makes the environment of the dataset's own `env_spec`, whose entry point may be any function there is.
"""

import json
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import minari
from gymnasium.envs.registration import parse_env_id
from gymnasium.error import Error
from gymnasium.spaces import Box
from minari.dataset.minari_dataset import parse_dataset_id
from minari.serialization import deserialize_space

from irl.core import files
from irl.core.config import from_json
from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos.episodes import DATA, read
from irl.demos.root import datasets_root
from irl.envs.make import check_flat
from irl.envs.tasks import TASKS, task_of

METADATA = "metadata.json"
DIGEST = "irl_data_sha256"
"""Key of the metadata with the SHA-256 of the data: damaged HDF5 can take the whole process down."""
LONGEST_ID = 200


@dataclass(frozen=True)
class Dataset:
    """What the metadata of a dataset say."""

    dataset_id: str
    path: Path
    """Its folder; the files are in `path / "data"`."""
    obs_space: Box
    action_space: Box
    episodes: int
    env_id: str | None
    algorithm: str | None
    author: str | None
    description: str | None
    random_return: float | None
    """Mean return of random actions, the zero of a normalised score."""
    expert_return: float | None
    """Mean return of the expert, the one of a normalised score."""
    digest: str | None


def list_datasets(root: Path | str | None = None) -> list[str]:
    """Ids of the datasets in a root, sorted; none where the root does not exist."""
    folder = datasets_root(root)
    found = [path.parent.parent.relative_to(folder) for path in folder.glob(f"**/data/{METADATA}")]
    # hidden folders hold what is being written
    return sorted(path.as_posix() for path in found if not any(part.startswith(".") for part in path.parts))


def check_id(dataset_id: str) -> None:
    """Refuse what Minari does not take for a dataset id.

    Raises:
        UserError: it is not of the form `folder/name-v0`.
    """
    try:
        # its pattern takes a time that grows with the square of the length, or worse
        valid = len(dataset_id) <= LONGEST_ID and "//" not in dataset_id
        if valid:
            parse_dataset_id(dataset_id)
    except (ValueError, TypeError):  # TypeError: without a version
        valid = False
    if not valid:
        raise UserError(
            f"{dataset_id[:LONGEST_ID]!r} is not a dataset id; expected folders and a name of letters, "
            "digits, _ and -, and a version, e.g. irl/hopper/expert-v0"
        )


def generate_command(dataset_id: str, root: Path | str | None = None) -> str:
    """What to type to make the dataset; the environment is guessed from the folders of the id."""
    parts = dataset_id.split("/")
    env_id = next((task.env_id for task in TASKS if task.name in parts), "ENV_ID")
    where = "" if root is None else f" --datasets-root {shlex.quote(str(root))}"
    return f"irl demos generate --env-id {env_id} --dataset-id {dataset_id}{where}"


def open_dataset(dataset_id: str, root: Path | str | None = None) -> Dataset:
    """The dataset of that id; reads its metadata and checks the digest of its data.

    Raises:
        UserError: not a dataset id; not there (says what is, and how to make it); not readable; of
            spaces that cannot be used.
    """
    check_id(dataset_id)
    folder = datasets_root(root)
    path = folder / dataset_id
    if not (path / "data").is_dir():
        there = ", ".join(list_datasets(folder)) or "none"
        raise UserError(
            f"no dataset {dataset_id!r} in {folder}; there: {there}; make it with "
            f"`{generate_command(dataset_id, root)}`"
        )
    try:
        dataset = _dataset(dataset_id, path, files.read_json(path / "data" / METADATA))
        _check_digest(dataset)
    # what Minari and Gymnasium raise over a space or an id that is none
    except (ValueError, LookupError, TypeError, AttributeError, AssertionError, OSError, Error) as error:
        raise _unreadable(dataset_id, path, error, root) from error
    except (ArithmeticError, MemoryError, RecursionError) as error:
        raise _unreadable(dataset_id, path, error, root) from error
    return dataset


def read_episodes(dataset: Dataset, root: Path | str | None = None) -> list[Episode]:
    """Every episode of the dataset, in its order; `irl.demos.episodes` says how.

    Raises:
        UserError: the data are damaged, or cannot have happened.
    """
    task = task_of(dataset.env_id) if dataset.env_id is not None else None
    sizes = dataset.obs_space.shape[0], dataset.action_space.shape[0]
    try:
        return read(dataset.path / "data" / DATA, dataset.episodes, sizes, task)
    # what h5py says of damage, by where it is
    except (ValueError, LookupError, TypeError, OSError, RuntimeError, SystemError, MemoryError) as error:
        raise _unreadable(dataset.dataset_id, dataset.path, error, root) from error


def _dataset(dataset_id: str, path: Path, content: Any) -> Dataset:
    metadata = from_json(dict[str, Any], content, METADATA)

    def optional(kind: Any, key: str) -> Any:
        return from_json(kind | None, metadata.get(key), f"{METADATA}.{key}")

    version, form = metadata.get("minari_version"), metadata.get("data_format")
    if version not in minari.supported_dataset_versions:
        raise ValueError(f"minari_version {version!r:.40}; Minari {minari.__version__} does not know it")
    if form != "hdf5":
        raise ValueError(f"data_format {form!r:.40}; expected 'hdf5'")
    return Dataset(
        dataset_id=dataset_id,
        path=path,
        obs_space=_space(metadata, "observation"),
        action_space=_space(metadata, "action"),
        episodes=from_json(int, metadata.get("total_episodes"), f"{METADATA}.total_episodes"),
        env_id=_env_id(optional(str, "env_spec")),
        algorithm=optional(str, "algorithm_name"),
        author=_author(metadata.get("author")),
        description=optional(str, "description"),
        random_return=optional(float, "ref_min_score"),
        expert_return=optional(float, "ref_max_score"),
        digest=optional(str, DIGEST),
    )


def _author(content: Any) -> str | None:
    """One name or several: older datasets have a string."""
    names = [content] if isinstance(content, str) else content or []
    return ", ".join(sorted(from_json(tuple[str, ...], names, f"{METADATA}.author"))) or None


def _space(metadata: Mapping[str, Any], of: str) -> Any:
    if (key := f"{of}_space") not in metadata:
        raise ValueError(f"{METADATA} names no {key}, and irl makes no environment that a file names")
    space = deserialize_space(from_json(str, metadata[key], f"{METADATA}.{key}"))
    check_flat("it", f"{of}s", space)
    return space


def _env_id(spec: str | None) -> str | None:
    """The id that a dataset's `env_spec` names; nothing else of it is looked at."""
    if spec is None:
        return None
    env_id = from_json(str, from_json(dict[str, Any], json.loads(spec), "env_spec").get("id"), "env_spec.id")
    if ":" in env_id or len(env_id) > LONGEST_ID:
        # gymnasium would import what stands before the colon; the id it records never has one
        raise ValueError(f"env_spec names the environment {env_id!r:.80}; expected an id without a module")
    parse_env_id(env_id)
    return env_id


def _check_digest(dataset: Dataset) -> None:
    data = dataset.path / "data" / DATA
    if dataset.digest is not None and (found := files.sha256(data)) != dataset.digest:
        raise ValueError(
            f"{DATA} has sha256 {found[:12]}, {METADATA} says {dataset.digest[:12]!r}; if you changed it, "
            f"take {DIGEST} out of {METADATA}"
        )


def _unreadable(dataset_id: str, path: Path, error: BaseException, root: Path | str | None) -> UserError:
    said = " ".join(str(error).split()) or type(error).__name__
    return UserError(
        f"dataset {dataset_id} in {path} cannot be read: {said:.400}; make it again with "
        f"`{generate_command(dataset_id, root)} --overwrite`"
    )
