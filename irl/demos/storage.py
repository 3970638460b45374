"""Minari's datasets on disk: their ids, what their metadata say, and their episodes as ours.

The files are read here and not by Minari, which would run what a dataset names: without its spaces it
makes the environment of the dataset's own `env_spec`, whose entry point may be any function there is.
"""

import shlex
from pathlib import Path

from gymnasium.error import Error
from minari.dataset.minari_dataset import parse_dataset_id

from irl.core import files
from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos import arrow, hdf5
from irl.demos.hdf5 import DATA
from irl.demos.metadata import DIGEST, LONGEST_ID, METADATA, Dataset, parse
from irl.demos.root import datasets_root
from irl.envs.tasks import TASKS


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


def open_dataset(dataset_id: str, root: Path | str | None = None, obs_keys: tuple[str, ...] = ()) -> Dataset:
    """The dataset of that id; reads its metadata and checks the digest of its data.

    Args:
        obs_keys: parts of observations in a dictionary that are put in a row, in this order.

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
        dataset = parse(dataset_id, path, files.read_json(path / "data" / METADATA), obs_keys)
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
        UserError: the data are damaged, or cannot have happened; or pyarrow is needed and not there.
    """
    data = dataset.path / "data"
    try:
        if dataset.form in arrow.FORMATS:
            arrow.pyarrow()
    except UserError as error:
        raise UserError(f"dataset {dataset.dataset_id} in {dataset.path}: {error}") from error
    try:
        if dataset.form in arrow.FORMATS:
            return arrow.read(data, dataset.form, dataset.episodes, dataset.layout)
        return hdf5.read(data / DATA, dataset.episodes, dataset.layout)
    # what h5py says of damage, by where it is
    except (ValueError, LookupError, TypeError, OSError, RuntimeError, SystemError, MemoryError) as error:
        raise _unreadable(dataset.dataset_id, dataset.path, error, root) from error


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
