"""`irl demos`: make, show and list demonstrations."""

from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from irl.core.config import check_at_least, check_seed
from irl.core.errors import UserError
from irl.core.rng import episode_seeds
from irl.demos.generate import generate
from irl.demos.info import show, table
from irl.demos.root import datasets_root
from irl.demos.storage import list_datasets
from irl.envs.make import make
from irl.envs.tasks import task_name
from irl.experiment.progress import each_episode, progress
from irl.policies import shelf
from irl.policies.card import Card
from irl.policies.policy import check_policy


@dataclass(frozen=True)
class GenerateDemos:
    """Record episodes of a shelved policy as a Minari dataset, with every reward term."""

    env_id: str
    """Gymnasium id of the task."""
    episodes: int = 25
    """How many episodes."""
    seed: int = 0
    """Draws the episodes' resets; the same seed gives the same arrays."""
    level: str = "expert"
    """Which policy of the shelf acts."""
    dataset_id: str = ""
    """Name of the dataset; irl/<task>/<level>-v0 unless given."""
    datasets_root: Path | None = None
    """Folder of Minari datasets; MINARI_DATASETS_PATH, or expert_data/datasets, unless given."""
    policies_root: Path | None = None
    """Where the shelf is; expert_data/policies unless given."""
    overwrite: bool = False
    """Replace a dataset of this name."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "episodes")
        check_seed(self.seed)
        shelf.check_level(self.level)


@dataclass(frozen=True)
class ShowDemos:
    """Describe a dataset: episodes, steps, returns, terms, size."""

    dataset_id: tyro.conf.Positional[str]
    """Name of the dataset."""
    datasets_root: Path | None = None
    """Folder of Minari datasets."""


@dataclass(frozen=True)
class ListDemos:
    """List the datasets there are."""

    datasets_root: Path | None = None
    """Folder of Minari datasets."""


def generate_demos(command: GenerateDemos) -> None:
    """Record the episodes and describe the dataset."""
    env = make(command.env_id)
    try:
        expert = shelf.find(command.env_id, command.level, command.policies_root)
        check_policy(expert.policy, env)
    finally:
        env.close()
    dataset_id = command.dataset_id or f"irl/{task_name(command.env_id)}/{command.level}-v0"
    with progress(dataset_id, command.episodes) as report:
        info = generate(
            command.env_id,
            expert.policy,
            dataset_id=dataset_id,
            root=command.datasets_root,
            seeds=episode_seeds(command.seed, "demonstrations", command.episodes),
            algorithm=expert.card.algorithm,
            author="irl",
            random_return=expert.card.random_return_mean,
            expert_return=_reference(command, expert.card),
            description=f"{command.level} of {command.env_id}, deterministic actions, seed {command.seed}",
            on_episode=each_episode(report),
            overwrite=command.overwrite,
        )
    Console().print(table(info))


def _reference(command: GenerateDemos, card: Card) -> float:
    """The return that counts as one: the expert's, also where a lesser level acts and an expert is there."""
    known = [c for c in shelf.cards(command.policies_root) if (c.env_id, c.level) == (card.env_id, "expert")]
    return (known or [card])[0].measured.return_mean


def show_demos(command: ShowDemos) -> None:
    """Print what a dataset holds."""
    Console().print(table(show(command.dataset_id, command.datasets_root)))


def list_demos(command: ListDemos) -> None:
    """Print the names of the datasets."""
    names = list_datasets(command.datasets_root)
    if not names:
        where = datasets_root(command.datasets_root)
        raise UserError(f"no datasets in {where}; make one with: irl demos generate --env-id Hopper-v5")
    for name in names:
        print(name)
