"""Every training command as one frozen dataclass: the command line and `config.json` are made from these."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar, Literal

from irl.algorithms.adversarial import ScheduleConfig
from irl.core.config import check_at_least, check_seed
from irl.discriminators.gail import GAILConfig
from irl.envs.tasks import task_name
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig


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
class GAILRun:
    """Generative adversarial imitation learning with PPO."""

    KIND: ClassVar[str] = "gail"
    env_id: str
    """Gymnasium id of the task, e.g. Hopper-v5."""
    demos: str = ""
    """Minari dataset of demonstrations; irl/<task>/expert-v0 unless given."""
    demo_episodes: int = 4
    """How many of its episodes to learn from; the rest is held out for `irl evaluate`."""
    steps: int = 245_760
    """Environment steps in all."""
    seed: int = 0
    """Seed of everything random."""
    out: Path | None = None
    """Run folder; runs/gail-<task>-s<seed> unless given."""
    datasets_root: Path | None = None
    """Folder of Minari datasets; MINARI_DATASETS_PATH, or expert_data/datasets, unless given."""
    learner: PPOConfig = field(default_factory=PPOConfig)
    discriminator: GAILConfig = field(default_factory=GAILConfig)
    schedule: ScheduleConfig = field(default_factory=ScheduleConfig)
    watch: Watch = field(default_factory=Watch)
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the networks live. MuJoCo runs on the CPU, and networks this small are fastest there too."""
    threads: int = 1
    """Threads of torch's operators; results are the same to the bit only at the same number."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "demo_episodes", "steps", "threads")
        check_seed(self.seed)

    def resolved(self) -> "GAILRun":
        """The same with every default that depends on another setting filled in."""
        task = task_name(self.env_id)
        return replace(
            self,
            demos=self.demos or f"irl/{task}/expert-v0",
            out=self.out or Path("runs") / f"gail-{task}-s{self.seed}",
        )


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
        check_at_least(self, 1, "steps", "threads")
        check_seed(self.seed)
