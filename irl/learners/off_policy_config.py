"""Settings that SAC and TD3 share."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from irl.core.config import check_at_least, check_widths


@dataclass(frozen=True)
class OffPolicyConfig:
    """How environments are stepped, what is remembered and drawn, and what is learned with.

    Named as in SB3, but: `learning_rate` is `lr` with its schedule, `train_freq` and `gradient_steps` are
    `updates_per_step`, `policy_kwargs` are `hidden` and `n_critics`. There are no `replay_buffer_*`,
    `optimize_memory_usage` and `n_steps`, because the memory is irl's own and rewards are decided as a batch
    is drawn.
    """

    KIND: ClassVar[str] = ""
    n_envs: int = 1
    """Environments stepped at once."""
    steps_per_round: int = 1000
    """Environment steps between two reports; a multiple of `n_envs`."""
    updates_per_step: float = 1.0
    """Updates per environment step."""
    learning_starts: int = 5000
    """Steps of uniformly random actions before the first update."""
    batch_size: int = 256
    """Transitions of one update."""
    buffer_size: int = 1_000_000
    """Transitions kept."""
    lr: float = 3e-4
    """Adam step size of all that is learned."""
    lr_schedule: Literal["constant", "linear"] = "constant"
    """`constant`, or `linear` from `lr` to 0 over the run."""
    gamma: float = 0.99
    """Discount per environment step."""
    tau: float = 0.005
    """How far targets follow."""
    n_critics: int = 2
    """Critics. The lowest counts; of those with quantiles, the lower part of all of them together."""
    hidden: tuple[int, ...] = (256, 256)
    """Width of each hidden layer of actor and critics, ReLU between."""
    products: Literal["float32", "bfloat16"] = "float32"
    """Number format of hidden layers' products. bfloat16 is faster where the CPU has it, and rounds to
    three digits: results differ from float32's, on three seeds within their spread."""
    reward_scaling: Literal["none", "std"] = "none"
    """What rewards are divided by: nothing, or the running deviation of all that were drawn."""
    reward_clip: float = 0.0
    """Bound of a reward after that; 0: none. What is saved is the reward before both."""
    average: float = 0.0
    """Decay a round of the moving average of weights that is exported; 0 exports the newest."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "n_envs", "steps_per_round", "batch_size", "buffer_size", "n_critics")
        check_at_least(self, 0, "learning_starts", "lr", "tau", "updates_per_step", "reward_clip")
        check_widths(self, "hidden")
        if self.steps_per_round % self.n_envs:
            raise ValueError(
                f"steps_per_round must be a multiple of n_envs ({self.n_envs}), not {self.steps_per_round}"
            )
        for name in ("gamma", "average"):
            if not 0.0 <= (value := getattr(self, name)) < 1.0:
                raise ValueError(f"{name} must be in [0, 1), not {value}")
