"""`irl demos generate`: demonstrations of one policy, or of every policy of the shelf."""

from dataclasses import dataclass
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from irl.core.config import check_at_least, check_seed
from irl.core.errors import UserError
from irl.core.rng import episode_seeds
from irl.demos.generate import generate
from irl.demos.info import DemosInfo, table
from irl.demos.players import Play, players
from irl.demos.recording import Recording
from irl.demos.root import datasets_root
from irl.envs.behaviour import Behaviour
from irl.envs.names import full_name
from irl.envs.tasks import task_name
from irl.experiment import actors
from irl.experiment.actors import Actor
from irl.experiment.imitation_run import Words
from irl.experiment.progress import each_episode, progress
from irl.experiment.shelved import cores
from irl.policies import shelf

EPISODES = 25
"""Of a dataset, unless they are counted or their seeds are named."""


@dataclass(frozen=True)
class GenerateDemos:
    """Record episodes of a policy as a Minari dataset, with every reward term."""

    env_id: str = ""
    """Gymnasium id of the task."""
    env_kwargs: Words = ()
    """What the environment is given, name=value or a JSON object."""
    all: bool = False
    """A dataset of every policy on the shelf, irl/<task>/<level>-v0; one that is there is kept."""
    policy: str = ""
    """Who acts instead of the shelf's: FILE.zip of Stable-Baselines3, FILE.safetensors of irl, or a function
    of an observation as module:function. A zip holds pickles, which can run any code: name only one whose
    maker you trust."""
    vec_normalize: Path | None = None
    """Statistics of VecNormalize that belong to the zip, FILE.pkl: a pickle too."""
    episodes: int | None = None
    """How many episodes are played; 25, or as many as the seed range has, unless given."""
    seed: int = 0
    """Draws the episodes' resets and what is random in the actions; the same seed gives the same arrays."""
    seed_range: tuple[int, int] | None = None
    """Reset with the seeds FIRST to LAST, LAST among them, instead of drawn ones."""
    stochastic: bool = False
    """Draw actions from the policy's own distribution, instead of its mode."""
    action_noise: float = 0.0
    """Standard deviation of Gaussian noise on actions, environment units; what is executed is recorded."""
    random_actions: float = 0.0
    """Probability that an action is uniformly random instead."""
    min_return: float | None = None
    """Drop episodes with a smaller return."""
    full_length: bool = False
    """Drop episodes that the task ended before its time limit."""
    subsampling_rate: int = 1
    """Noted in the dataset: every so-manieth step is meant to be learned from. All are kept; --demo-rate of
    irl train applies one."""
    level: str | None = None
    """Which policy of the shelf acts; expert, or with --all every one, unless given."""
    dataset_id: str = ""
    """Name of the dataset; irl/<task>/<level>-v0 unless given, irl/<task>/own-v0 with --policy."""
    datasets_root: Path | None = None
    """Folder of Minari datasets; MINARI_DATASETS_PATH, or expert_data/datasets, unless given."""
    policies_root: Path | None = None
    """Where the shelf is; expert_data/policies unless given."""
    workers: int | None = None
    """Processes that play, for policies of the shelf; 1, or with --all one a core, unless given."""
    overwrite: bool = False
    """Replace a dataset of this name."""

    def __post_init__(self) -> None:
        for name in ("episodes", "workers"):
            if getattr(self, name) is not None:
                check_at_least(self, 1, name)
        check_seed(self.seed)
        shelf.check_level(self.level or "expert")
        self._check_who()
        self._check_seeds()
        # refuses what it cannot be
        _ = self.how

    def _check_who(self) -> None:
        if self.all == bool(self.env_id):
            raise ValueError("name one task with --env-id, or take every policy of the shelf with --all")
        if self.all and (self.policy or self.dataset_id or self.env_kwargs):
            raise ValueError("--all takes the shelf as it is: no --policy, --dataset-id or --env-kwargs")
        if self.vec_normalize is not None and not self.policy:
            raise ValueError("vec_normalize belongs to a policy; name its zip with --policy")
        if self.policy and self.level is not None:
            raise ValueError("--level chooses a policy of the shelf; leave it or --policy away")
        if self.policy and (self.workers or 1) > 1:
            raise ValueError("--workers is for policies of the shelf; one named with --policy plays here")

    def _check_seeds(self) -> None:
        if self.seed_range is None:
            return
        first, last = self.seed_range
        if not 0 <= first <= last < 2**31:
            raise ValueError(f"seed_range must be FIRST to LAST from 0 to 2^31 - 1, not {first} {last}")
        if self.episodes not in (None, last - first + 1):
            raise ValueError(
                f"seed_range has {last - first + 1} seeds for {self.episodes} episodes; leave one away"
            )

    @property
    def how(self) -> Recording:
        """What is done to the actions, and which episodes are kept."""
        behaviour = Behaviour(self.stochastic, self.action_noise, self.random_actions)
        return Recording(self.seed, behaviour, self.subsampling_rate, self.min_return, self.full_length)

    @property
    def seeds(self) -> list[int]:
        """What the environment is reset with, an episode."""
        if self.seed_range is not None:
            return list(range(self.seed_range[0], self.seed_range[1] + 1))
        return episode_seeds(self.seed, "demonstrations", self.episodes or EPISODES)


def generate_demos(command: GenerateDemos) -> None:
    """Record the episodes and describe the dataset, or every one."""
    with players(command.workers or (cores() if command.all else 1)) as play:
        if command.all:
            _generate_all(command, play)
            return
        env_id, root = full_name(command.env_id, command.env_kwargs), command.policies_root
        if command.policy:
            actor = actors.named(command.policy, env_id, command.vec_normalize, root)
        else:
            actor = actors.shelved(env_id, command.level or "expert", root)
        level = "own" if command.policy else command.level or "expert"
        dataset_id = command.dataset_id or f"irl/{task_name(env_id)}/{level}-v0"
        Console().print(table(_generated(command, env_id, actor, dataset_id, play)))


def _generate_all(command: GenerateDemos, play: Play) -> None:
    """A dataset of every card; those that are there stay."""
    root, console = command.policies_root, Console()
    cards = shelf.to_play(command.level, root)
    if not cards:
        raise UserError("no such policy on the shelf; train one with: irl experts train --env-id Hopper-v5")
    made = []
    for card in cards:
        dataset_id = f"irl/{task_name(card.env_id)}/{card.level}-v0"
        if (datasets_root(command.datasets_root) / dataset_id / "data").is_dir() and not command.overwrite:
            console.print(f"{dataset_id} is there and kept; --overwrite replaces it", highlight=False)
            continue
        actor = actors.shelved(card.env_id, card.level, root)
        made.append(_generated(command, card.env_id, actor, dataset_id, play))
    if made:
        console.print(_summary(made))


def _generated(command: GenerateDemos, env_id: str, actor: Actor, dataset_id: str, play: Play) -> DemosInfo:
    seeds = command.seeds
    with progress(dataset_id, len(seeds)) as report:
        try:
            return generate(
                env_id,
                actor.act,
                dataset_id=dataset_id,
                root=command.datasets_root,
                seeds=seeds,
                algorithm=actor.algorithm,
                author="irl",
                random_return=actor.random_return,
                expert_return=actor.expert_return,
                description=_description(command, env_id, actor),
                how=command.how,
                play=play,
                on_episode=each_episode(report),
                overwrite=command.overwrite,
            )
        except ValueError as error:
            if isinstance(error, UserError) or not command.policy:
                raise
            # actions of another shape, or that are not numbers
            raise UserError(f"--policy {command.policy}: {error}") from error


def _description(command: GenerateDemos, env_id: str, actor: Actor) -> str:
    actions = "deterministic actions" if command.how.behaviour == Behaviour() else "changed actions"
    resets = (
        f"seed {command.seed}"
        if command.seed_range is None
        else "resets {} to {}".format(*command.seed_range)
    )
    return f"{actor.called} of {env_id}, {actions}, {resets}"


def _summary(infos: list[DemosInfo]) -> Table:
    found = Table(box=box.SIMPLE_HEAD)
    for column in ("dataset", "episodes", "steps", "return", "size"):
        found.add_column(column, no_wrap=True)
    for info in infos:
        found.add_row(
            Text(info.dataset_id),
            f"{info.episodes}",
            f"{info.steps:,}",
            f"{info.return_mean:.1f} ± {info.return_std:.1f}",
            f"{info.size_bytes / 1e6:.1f} MB",
        )
    return found
