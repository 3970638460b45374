"""`irl demos show` and `list`."""

from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from irl.core.errors import UserError
from irl.demos.info import show, table
from irl.demos.root import datasets_root
from irl.demos.storage import list_datasets
from irl.experiment.imitation_run import Keys


@dataclass(frozen=True)
class ShowDemos:
    """Describe a dataset: episodes, steps, returns, terms, size."""

    dataset_id: tyro.conf.Positional[str]
    """Name of the dataset."""
    obs_keys: Keys = ()
    """Parts of observations in a dictionary, to be put in a row."""
    datasets_root: Path | None = None
    """Folder of Minari datasets."""


@dataclass(frozen=True)
class ListDemos:
    """List the datasets there are."""

    datasets_root: Path | None = None
    """Folder of Minari datasets."""


def show_demos(command: ShowDemos) -> None:
    """Print what a dataset holds."""
    Console().print(table(show(command.dataset_id, command.datasets_root, command.obs_keys)))


def list_demos(command: ListDemos) -> None:
    """Print the names of the datasets."""
    names = list_datasets(command.datasets_root)
    if not names:
        where = datasets_root(command.datasets_root)
        raise UserError(f"no datasets in {where}; make one with: irl demos generate --env-id Hopper-v5")
    for name in names:
        print(name)
