"""Every training command as one frozen dataclass: the command line and `config.json` are made from these."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import tyro

from irl.algorithms.adversarial import ReplayedScheduleConfig, ScheduleConfig
from irl.algorithms.interleaved import InterleavedConfig
from irl.core import products
from irl.core.config import check_at_least, check_seed, check_threads
from irl.discriminators.airl import AIRLConfig
from irl.discriminators.dac import DACConfig
from irl.discriminators.gail import GAILConfig
from irl.envs.names import full_name
from irl.envs.tasks import task_name
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig

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
    ADDED: ClassVar[dict[str, Any]] = {"env_kwargs": [], "demo_rate": 1}
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

    def resolved(self: Run) -> Run:
        """The same with every default that depends on another setting filled in."""
        env_id = full_name(self.env_id, self.env_kwargs)
        task = task_name(env_id)
        return replace(
            self,
            env_id=env_id,
            env_kwargs=(),
            demos=self.demos or f"irl/{task}/expert-v0",
            out=self.out or Path("runs") / f"{self.KIND}-{task}-s{self.seed}",
        )


@dataclass(frozen=True)
class GAILRun(ImitationRun):
    """Generative adversarial imitation learning with PPO."""

    KIND: ClassVar[str] = "gail"
    learner: PPOConfig = field(default_factory=PPOConfig)
    discriminator: GAILConfig = field(default_factory=GAILConfig)
    schedule: ScheduleConfig = field(default_factory=ScheduleConfig)


# On rewards that move, an update with each step; random actions only until there is a batch or four.
# Quantile critics, a rate that falls to 0 and averaged weights: scripts/benchmarks/RESULTS.md has what each
# seed of tuning came to without and with them.
OFF_POLICY = SACConfig(
    learning_starts=1000,
    lr=5e-4,
    lr_schedule="linear",
    quantiles=25,
    products=products.fastest(),
    average=0.9,
)
"""SAC beside a discriminator, or on what one left."""


@dataclass(frozen=True)
class GAILSACRun(ImitationRun):
    """Generative adversarial imitation learning with SAC, on the steps of its whole memory."""

    KIND: ClassVar[str] = "gail-sac"
    demo_episodes: int = 5
    """How many of its episodes to learn from; the rest is held out for `irl evaluate`."""
    steps: int = 150_000
    """Environment steps in all."""
    learner: SACConfig = OFF_POLICY
    discriminator: GAILConfig = field(default_factory=GAILConfig)
    schedule: InterleavedConfig = field(default_factory=InterleavedConfig)


@dataclass(frozen=True)
class DACRun(ImitationRun):
    """Discriminator-actor-critic: SAC, the logit as reward, and terminations led into an absorbing state."""

    KIND: ClassVar[str] = "dac"
    demo_episodes: int = 5
    """How many of its episodes to learn from; the rest is held out for `irl evaluate`."""
    steps: int = 150_000
    """Environment steps in all."""
    learner: SACConfig = OFF_POLICY
    discriminator: DACConfig = field(default_factory=DACConfig)
    schedule: InterleavedConfig = field(default_factory=InterleavedConfig)


@dataclass(frozen=True)
class AIRLRun(ImitationRun):
    """Adversarial inverse reinforcement learning with PPO: a reward that can be taken elsewhere."""

    KIND: ClassVar[str] = "airl"
    demo_episodes: int = 5
    """How many of its episodes to learn from; the rest is held out for `irl evaluate`."""
    steps: int = 1_000_000
    """Environment steps in all."""
    learner: PPOConfig = field(default_factory=PPOConfig)
    discriminator: AIRLConfig = field(default_factory=AIRLConfig)
    schedule: ReplayedScheduleConfig = field(default_factory=ReplayedScheduleConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.discriminator.reward == "f-log-pi" and self.learner.ent_coef > 0:
            raise ValueError(
                f"entropy would be paid twice: discriminator.reward is f-log-pi and learner.ent_coef is "
                f"{self.learner.ent_coef}; set one of --learner.ent-coef 0 and --discriminator.reward f"
            )


@dataclass(frozen=True)
class AIRLSACRun(ImitationRun):
    """Adversarial inverse reinforcement learning with SAC, on the steps of its whole memory."""

    KIND: ClassVar[str] = "airl-sac"
    demo_episodes: int = 5
    """How many of its episodes to learn from; the rest is held out for `irl evaluate`."""
    steps: int = 150_000
    """Environment steps in all."""
    learner: SACConfig = OFF_POLICY
    discriminator: AIRLConfig = field(default_factory=lambda: AIRLConfig(lr=3e-4, reward="f"))
    schedule: InterleavedConfig = field(default_factory=InterleavedConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.discriminator.reward == "f-log-pi":
            raise ValueError(
                "entropy would be paid twice: SAC has an entropy bonus of its own, and discriminator.reward "
                "is f-log-pi; use --discriminator.reward f"
            )


Imitation = GAILRun | GAILSACRun | DACRun | AIRLRun | AIRLSACRun
"""Every method there is, by its `KIND`."""


@dataclass(frozen=True)
class ExpertRun:
    """Reinforcement learning on the task's own reward, for the shelf of experts."""

    KIND: ClassVar[str] = "expert"
    env_id: str
    level: str
    steps: int
    seed: int
    out: Path
    learner: PPOConfig | SACConfig
    watch: Watch
    device: Literal["cpu", "cuda"]
    threads: int

    def __post_init__(self) -> None:
        check_at_least(self, 1, "steps")
        check_threads(self.threads)
        check_seed(self.seed)


@dataclass(frozen=True)
class RetrainRun:
    """Reinforcement learning on the frozen reward of a run's snapshot."""

    KIND: ClassVar[str] = "retrain"
    run: Path
    """The run whose reward it is."""
    snapshot: int
    """Environment steps of that run when the reward was saved."""
    env_id: str
    steps: int
    seed: int
    out: Path
    learner: PPOConfig | SACConfig
    watch: Watch
    device: Literal["cpu", "cuda"]
    threads: int

    def __post_init__(self) -> None:
        check_at_least(self, 1, "steps")
        check_threads(self.threads)
        check_at_least(self, 0, "snapshot")
        check_seed(self.seed)
