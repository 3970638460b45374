"""Every training command as one frozen dataclass: the command line and `config.json` are made from these."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Literal, TypeVar

from irl.algorithms.adversarial import ReplayedScheduleConfig, ScheduleConfig
from irl.algorithms.bc import CloningConfig
from irl.algorithms.interleaved import InterleavedConfig
from irl.core import products
from irl.core.config import check_at_least, check_seed, check_threads, check_widths
from irl.core.errors import UserError
from irl.discriminators.airl import AIRLConfig
from irl.discriminators.dac import DACConfig
from irl.discriminators.gail import GAILConfig
from irl.experiment.imitation_run import AdversarialRun, ImitationRun, Watch
from irl.learners.off_policy_config import OffPolicyConfig
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig
from irl.learners.td3 import TD3Config

OffPolicy = TypeVar("OffPolicy", bound="OffPolicyRun")


@dataclass(frozen=True)
class GAILRun(AdversarialRun):
    """Generative adversarial imitation learning with PPO."""

    KIND: ClassVar[str] = "gail"
    learner: PPOConfig = field(default_factory=PPOConfig)
    discriminator: GAILConfig = field(default_factory=GAILConfig)
    schedule: ScheduleConfig = field(default_factory=ScheduleConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_tail(self.learner, self.discriminator.absorbing_scale)


def _check_tail(learner: PPOConfig, absorbing_scale: float) -> None:
    """PPO is paid all that the absorbing state pays with the termination; a bound on it would pay dying."""
    if learner.reward_clip > 0 and absorbing_scale > 0:
        raise ValueError(
            f"--learner.reward-clip {learner.reward_clip} would cut off what the absorbing state pays PPO at "
            f"a termination; leave it out, or learn off policy, where that state is in the memory"
        )


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


# The paper's, and random actions as in the code of DAC's authors: nothing of TD3 was tuned here.
OFF_POLICY_TD3 = TD3Config(learning_starts=1000, products=products.fastest())
"""TD3 beside a discriminator, or on what one left."""


def untaught(learner: PPOConfig | OffPolicyConfig, steps: int) -> str:
    """Why a run of so many steps leaves the policy as it began, and what to type; empty where it learns."""
    first, linear = learner.steps_per_round, learner.lr_schedule == "linear"
    # the last round is played to its end
    played = -(-steps // first) * first
    if isinstance(learner, OffPolicyConfig):
        first = (learner.learning_starts // learner.n_envs + 1) * learner.n_envs
    if first > played:
        why = f"and the run ends at {played}"
    elif linear and first >= steps:
        why = "where lr_schedule linear has come to 0"
    else:
        return ""
    return (
        f"--steps {steps} leaves the policy as it began: the first update of {learner.KIND.upper()} is at "
        f"step {first}, {why}; choose --steps {first + linear} or more"
    )


def check_learns(learner: PPOConfig | OffPolicyConfig, steps: int) -> None:
    """Refuse a run off policy that ends before its first update.

    A single round of PPO passes: beside a discriminator, the reward learns in it.

    Raises:
        UserError: it does.
    """
    if isinstance(learner, OffPolicyConfig) and (why := untaught(learner, steps)):
        raise UserError(why)


@dataclass(frozen=True)
class OffPolicyRun(AdversarialRun):
    """What every method that learns off policy is told besides."""

    demo_episodes: int = 5
    """How many of its episodes to learn from; the rest is held out for `irl evaluate`."""
    steps: int = 150_000
    """Environment steps in all."""
    learner: SACConfig | TD3Config = OFF_POLICY
    schedule: InterleavedConfig = field(default_factory=InterleavedConfig)

    def resolved(self: OffPolicy) -> OffPolicy:
        """As of every method, for a run to come.

        Raises:
            UserError: it would end before its first update. Settings of earlier runs that did are still read.
        """
        check_learns(self.learner, self.steps)
        return super().resolved()


@dataclass(frozen=True)
class GAILSACRun(OffPolicyRun):
    """Generative adversarial imitation learning with SAC, on the steps of its whole memory."""

    KIND: ClassVar[str] = "gail-sac"
    learner: SACConfig = OFF_POLICY
    discriminator: GAILConfig = field(default_factory=GAILConfig)


@dataclass(frozen=True)
class GAILTD3Run(OffPolicyRun):
    """Generative adversarial imitation learning with TD3, on the steps of its whole memory."""

    KIND: ClassVar[str] = "gail-td3"
    learner: TD3Config = OFF_POLICY_TD3
    discriminator: GAILConfig = field(default_factory=GAILConfig)


@dataclass(frozen=True)
class DACRun(OffPolicyRun):
    """Discriminator-actor-critic: SAC, the logit as reward, and terminations led into an absorbing state."""

    KIND: ClassVar[str] = "dac"
    learner: SACConfig = OFF_POLICY
    discriminator: DACConfig = field(default_factory=DACConfig)


@dataclass(frozen=True)
class DACTD3Run(OffPolicyRun):
    """Discriminator-actor-critic with TD3, as in its paper."""

    KIND: ClassVar[str] = "dac-td3"
    learner: TD3Config = OFF_POLICY_TD3
    discriminator: DACConfig = field(default_factory=DACConfig)


# With AIRL's reward the newest weights stand still at one evaluation and run at the next.
AVERAGED = PPOConfig(average=0.95)
"""PPO beside AIRL's discriminator."""


@dataclass(frozen=True)
class AIRLRun(AdversarialRun):
    """Adversarial inverse reinforcement learning with PPO: a reward that can be taken elsewhere."""

    KIND: ClassVar[str] = "airl"
    demo_episodes: int = 5
    """How many of its episodes to learn from; the rest is held out for `irl evaluate`."""
    steps: int = 1_000_000
    """Environment steps in all."""
    learner: PPOConfig = AVERAGED
    discriminator: AIRLConfig = field(default_factory=AIRLConfig)
    schedule: ReplayedScheduleConfig = field(default_factory=ReplayedScheduleConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_tail(self.learner, self.discriminator.scale)
        if self.discriminator.reward == "f-log-pi" and self.learner.ent_coef > 0:
            raise ValueError(
                f"entropy would be paid twice: discriminator.reward is f-log-pi and learner.ent_coef is "
                f"{self.learner.ent_coef}; set one of --learner.ent-coef 0 and --discriminator.reward f"
            )


@dataclass(frozen=True)
class AIRLSACRun(OffPolicyRun):
    """Adversarial inverse reinforcement learning with SAC, on the steps of its whole memory."""

    KIND: ClassVar[str] = "airl-sac"
    learner: SACConfig = OFF_POLICY
    discriminator: AIRLConfig = field(default_factory=lambda: AIRLConfig(lr=3e-4, reward="f"))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.discriminator.reward == "f-log-pi":
            raise ValueError(
                "entropy would be paid twice: SAC has an entropy bonus of its own, and discriminator.reward "
                "is f-log-pi; use --discriminator.reward f"
            )


@dataclass(frozen=True)
class ClonedConfig(CloningConfig):
    """What kind of policy is fitted, and how."""

    KIND: ClassVar[str] = "bc"
    policy: Literal["gaussian", "squashed_gaussian"] = "gaussian"
    """How real-valued actions are drawn: as PPO's, clipped to their bounds, or squashed into them."""
    hidden: tuple[int, ...] = (256, 256)
    """Width of each hidden layer."""
    activation: Literal["tanh", "relu"] = "relu"
    """Between the layers."""
    steps_per_round: int = 1000
    """Gradient steps between two reports."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_at_least(self, 1, "steps_per_round")
        check_widths(self, "hidden")


@dataclass(frozen=True)
class BCRun(ImitationRun):
    """Behavioural cloning: a policy from demonstrations, without a reward and without an environment."""

    KIND: ClassVar[str] = "bc"
    demo_episodes: int = 5
    """How many of its episodes to learn from; the rest is held out."""
    steps: int = 20_000
    """Gradient steps in all."""
    learner: ClonedConfig = field(default_factory=ClonedConfig)


Imitation = GAILRun | GAILSACRun | GAILTD3Run | DACRun | DACTD3Run | AIRLRun | AIRLSACRun
"""Every method that learns a reward, by its `KIND`."""

FromDemonstrations = Imitation | BCRun
"""Every method that learns from demonstrations."""


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
    ADDED: ClassVar[dict[str, Any]] = {"entropy": 0.0, "average": False, "hand_written": False}
    run: Path
    """The run whose reward it is."""
    snapshot: int
    """Environment steps of that run when the reward was saved."""
    average: bool
    """Whether it is the mean of that reward and those of the snapshots before it."""
    hand_written: bool
    """Whether the policy learns from the task's own reward instead."""
    env_id: str
    steps: int
    seed: int
    out: Path
    learner: PPOConfig | SACConfig | TD3Config
    entropy: float
    """What a nat of PPO's own entropy pays beside the reward."""
    watch: Watch
    device: Literal["cpu", "cuda"]
    threads: int

    def __post_init__(self) -> None:
        check_at_least(self, 1, "steps")
        check_threads(self.threads)
        check_at_least(self, 0, "snapshot", "entropy")
        check_seed(self.seed)
