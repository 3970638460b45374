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
from irl.envs.names import full_name
from irl.envs.tasks import task_name
from irl.experiment import actors
from irl.experiment.configs import Keys, Words
from irl.experiment.progress import each_episode, progress
from irl.policies import shelf


@dataclass(frozen=True)
class GenerateDemos:
    """Record episodes of a policy as a Minari dataset, with every reward term."""

    env_id: str
    """Gymnasium id of the task."""
    env_kwargs: Words = ()
    """What the environment is given, name=value or a JSON object."""
    policy: str = ""
    """Who acts instead of the shelf's: FILE.zip of Stable-Baselines3, FILE.safetensors of irl, or a function
    of an observation as module:function. A zip holds pickles, which can run any code: name only one whose
    maker you trust."""
    vec_normalize: Path | None = None
    """Statistics of VecNormalize that belong to the zip, FILE.pkl: a pickle too."""
    episodes: int = 25
    """How many episodes."""
    seed: int = 0
    """Draws the episodes' resets; the same seed gives the same arrays."""
    level: str = "expert"
    """Which policy of the shelf acts."""
    dataset_id: str = ""
    """Name of the dataset; irl/<task>/<level>-v0 unless given, irl/<task>/own-v0 with --policy."""
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
        if self.vec_normalize is not None and not self.policy:
            raise ValueError("vec_normalize belongs to a policy; name its zip with --policy")


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


def generate_demos(command: GenerateDemos) -> None:
    """Record the episodes and describe the dataset."""
    env_id = full_name(command.env_id, command.env_kwargs)
    root = command.policies_root
    if command.policy:
        actor = actors.named(command.policy, env_id, command.vec_normalize, root)
    else:
        actor = actors.shelved(env_id, command.level, root)
    level = "own" if command.policy else command.level
    dataset_id = command.dataset_id or f"irl/{task_name(env_id)}/{level}-v0"
    with progress(dataset_id, command.episodes) as report:
        try:
            info = generate(
                env_id,
                actor.act,
                dataset_id=dataset_id,
                root=command.datasets_root,
                seeds=episode_seeds(command.seed, "demonstrations", command.episodes),
                algorithm=actor.algorithm,
                author="irl",
                random_return=actor.random_return,
                expert_return=actor.expert_return,
                description=f"{actor.called} of {env_id}, deterministic actions, seed {command.seed}",
                on_episode=each_episode(report),
                overwrite=command.overwrite,
            )
        except ValueError as error:
            if isinstance(error, UserError) or not command.policy:
                raise
            # actions of another shape, or that are not numbers
            raise UserError(f"--policy {command.policy}: {error}") from error
    Console().print(table(info))


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
