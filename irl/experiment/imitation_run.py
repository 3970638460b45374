"""What every command that learns from demonstrations is told."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import tyro

from irl.algorithms.bc import WarmStartConfig
from irl.core.config import check_at_least, check_seed, check_threads, to_json
from irl.envs.names import full_name
from irl.envs.tasks import task_name

Run = TypeVar("Run", bound="ImitationRun")
Words = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=VALUE ...")]
Keys = Annotated[tuple[str, ...], tyro.conf.arg(metavar="KEY ...")]


@dataclass(frozen=True)
class Watch:
    """What is written down while it trains; none of it changes a weight."""

    eval_every: int = 10
    """Rounds between two evaluations of the deterministic policy; 0 evaluates at the end only."""
    eval_episodes: int = 5
    """Episodes of one such evaluation."""
    checkpoint_every_s: float = 120.0
    """Seconds between two checkpoints."""
    tensorboard: bool = True
    """Write curves for TensorBoard into the run folder."""
    progress: bool = True
    """Show a progress bar, or a line now and then where there is no terminal."""

    def __post_init__(self) -> None:
        check_at_least(self, 0, "eval_every", "eval_episodes", "checkpoint_every_s")


@dataclass(frozen=True)
class ImitationRun:
    """What every method that learns from demonstrations is told."""

    KIND: ClassVar[str] = ""
    ADDED: ClassVar[dict[str, Any]] = {"env_kwargs": [], "demo_rate": 1, "seeds": ""}
    env_id: str
    """Gymnasium id of the task, e.g. Hopper-v5."""
    env_kwargs: Words = ()
    """What the environment is given, name=value or a JSON object; becomes part of env_id."""
    demos: str = ""
    """Minari dataset of demonstrations; irl/<task>/expert-v0 unless given."""
    demo_episodes: int = 4
    """How many of its episodes to learn from; the rest is held out for `irl evaluate`."""
    demo_rate: int = 1
    """Keep every so-manieth step of them, from an offset drawn for each; with an absorbing state, all of its
    steps stay, at the weight of one."""
    steps: int = 245_760
    """Environment steps in all."""
    seed: int = 0
    """Seed of everything random."""
    seeds: str = ""
    """Several seeds instead, e.g. 0-4 or 0,3,7: a run folder each, s<seed> in `out`, and a summary."""
    out: Path | None = None
    """Run folder; runs/<method>-<task>-s<seed> unless given."""
    datasets_root: Path | None = None
    """Folder of Minari datasets; MINARI_DATASETS_PATH, or expert_data/datasets, unless given."""
    watch: Watch = field(default_factory=Watch)
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the networks live. MuJoCo runs on the CPU, and networks this small are fastest there too."""
    threads: int = 1
    """Threads of torch's operators; results are the same to the bit only at the same number."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "demo_episodes", "demo_rate", "steps")
        check_threads(self.threads)
        check_seed(self.seed)
        if self.seeds and self.seed:
            raise ValueError(f"name one of --seed {self.seed} and --seeds {self.seeds}")
        for seed in self.seed_numbers:
            check_seed(seed)

    @property
    def seed_numbers(self) -> tuple[int, ...]:
        """The seeds that `seeds` names, in order; none where it is empty.

        Raises:
            ValueError: it is not of the form 0-4 or 0,3,7, or names a seed twice.
        """
        numbers: list[int] = []
        for part in filter(None, self.seeds.split(",")):
            first, _, last = part.partition("-")
            if not (first.isdecimal() and (last or first).isdecimal()) or int(last or first) < int(first):
                raise ValueError(f"seeds must be like 0-4 or 0,3,7, not {self.seeds!r:.40}")
            if int(last or first) - int(first) > 999:
                raise ValueError(f"seeds {self.seeds!r:.40} are more than a thousand")
            numbers += range(int(first), int(last or first) + 1)
        if len(set(numbers)) < len(numbers) or (self.seeds and not numbers):
            raise ValueError(f"seeds must be like 0-4 or 0,3,7, each once, not {self.seeds!r:.40}")
        return tuple(numbers)

    @property
    def folder_of_seeds(self) -> Path:
        """Where the folders of several seeds are."""
        return self.out or Path("runs") / f"{self.KIND}-{task_name(full_name(self.env_id, self.env_kwargs))}"

    def resolved(self: Run) -> Run:
        """The same with every default that depends on another setting filled in."""
        env_id = full_name(self.env_id, self.env_kwargs)
        task = task_name(env_id)
        return replace(
            self,
            env_id=env_id,
            env_kwargs=(),
            demos=self.demos or f"irl/{task}/expert-v0",
            # a run may go on from another folder
            datasets_root=self.datasets_root and self.datasets_root.expanduser().absolute(),
            out=self.out or Path("runs") / f"{self.KIND}-{task}-s{self.seed}",
        )


@dataclass(frozen=True)
class AdversarialRun(ImitationRun):
    """What every method with a discriminator is told besides."""

    ADDED: ClassVar[dict[str, Any]] = ImitationRun.ADDED | {"warm_start": to_json(WarmStartConfig())}
    ADDED |= {"preset": "", "normaliser": "expert"}
    preset: str = ""
    """Settings of a paper, over which typed ones go; irl/experiment/presets.py has each with its source."""
    warm_start: WarmStartConfig = field(default_factory=WarmStartConfig)
    normaliser: Literal["expert", "mixed"] = "expert"
    """Whose mean and deviation observations are normalised by, fixed all through: the demonstrations', or
    those of the demonstrations and of random actions, evenly. Where an expert holds a joint still, any other
    place of it is many of its deviations away, and from ten on one is as far as another."""
