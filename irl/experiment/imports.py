"""`irl demos import`, `merge` and `split`: demonstrations from elsewhere, and datasets out of datasets."""

import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from irl.core.config import check_seed
from irl.core.errors import UserError
from irl.demos.curate import merge, split
from irl.demos.importers import import_file
from irl.demos.info import table
from irl.envs.names import full_name
from irl.envs.tasks import task_name
from irl.experiment.imitation_run import Keys, Words
from irl.experiment.judge import finite
from irl.policies.card import measure_random


@dataclass(frozen=True)
class ImportDemos:
    """Make a Minari dataset of a file: .npz, .csv, .hdf5 as of D4RL, .parquet.

    irl/demos/sources.py says what the arrays are called, irl/demos/borders.py how episodes lie in them.
    Everything is held against the task, and nothing is written where something does not fit.
    """

    file: tyro.conf.Positional[Path]
    """The file; its ending says which format it has."""
    env_id: str
    """Gymnasium id of the task."""
    env_kwargs: Words = ()
    """What the environment is given, name=value or a JSON object."""
    dataset_id: Annotated[str, tyro.conf.arg(aliases=["--name"])] = ""
    """Name of the dataset; irl/<task>/imported-v0 unless given."""
    author: str = ""
    """Whose demonstrations they are."""
    datasets_root: Path | None = None
    """Folder of Minari datasets; MINARI_DATASETS_PATH, or expert_data/datasets, unless given."""
    overwrite: bool = False
    """Replace a dataset of this name."""


@dataclass(frozen=True)
class MergeDemos:
    """Make one dataset of several."""

    datasets: tyro.conf.Positional[tuple[str, ...]]
    """Names of the datasets, of one task."""
    into: str
    """Name of the new one."""
    obs_keys: Keys = ()
    """Parts of observations in a dictionary, which the new one has in a row."""
    datasets_root: Path | None = None
    """Folder of Minari datasets."""
    overwrite: bool = False
    """Replace a dataset of this name."""


@dataclass(frozen=True)
class SplitDemos:
    """Make two datasets of one: whole episodes to learn from, and others held out."""

    dataset_id: tyro.conf.Positional[str]
    """Name of the dataset."""
    held_out: float = 0.2
    """Share of the episodes that is held out; at least one goes to each side."""
    seed: int = 0
    """Draws which."""
    into: tuple[str, str] | None = None
    """Names of the two; those of the dataset with -train and -held-out before the version unless given."""
    obs_keys: Keys = ()
    """Parts of observations in a dictionary, which the two have in a row."""
    datasets_root: Path | None = None
    """Folder of Minari datasets."""
    overwrite: bool = False
    """Replace datasets of these names."""

    def __post_init__(self) -> None:
        check_seed(self.seed)
        if not 0.0 < self.held_out < 1.0:
            raise ValueError(f"held_out must be between 0 and 1, not {self.held_out}")


def import_demos(command: ImportDemos) -> None:
    """Import, and say what was left out."""
    env_id = full_name(command.env_id, command.env_kwargs)
    if not command.file.is_file():
        # before random actions are played for a reference
        raise UserError(f"no file {command.file}")
    info, notes = import_file(
        command.file,
        env_id,
        dataset_id=command.dataset_id or f"irl/{task_name(env_id)}/imported-v0",
        root=command.datasets_root,
        random_return=lambda: finite(measure_random(env_id).return_mean),
        author=command.author or None,
        overwrite=command.overwrite,
    )
    for note in notes:
        print(f"irl: {note}", file=sys.stderr)
    Console().print(table(info))


def merge_demos(command: MergeDemos) -> None:
    """Merge and describe."""
    info = merge(
        command.datasets,
        command.into,
        root=command.datasets_root,
        obs_keys=command.obs_keys,
        overwrite=command.overwrite,
    )
    Console().print(table(info))


def split_demos(command: SplitDemos) -> None:
    """Split and describe both."""
    parts = split(
        command.dataset_id,
        command.into or _names(command.dataset_id),
        held_out=command.held_out,
        seed=command.seed,
        root=command.datasets_root,
        obs_keys=command.obs_keys,
        overwrite=command.overwrite,
    )
    for part in parts:
        Console().print(table(part))


def _names(dataset_id: str) -> tuple[str, str]:
    # an id without a version is refused later, by its own name
    found = re.fullmatch(r"(.*?)(-v\d+)?", dataset_id)
    assert found is not None
    return f"{found[1]}-train{found[2] or ''}", f"{found[1]}-held-out{found[2] or ''}"
