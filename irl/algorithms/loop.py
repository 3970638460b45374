"""What every training loop shares: the record of a round, and what a learner can do."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from jaxtyping import Float
from torch import Tensor

from irl.core.types import Metrics, RewardFn, Transitions
from irl.policies.policy import Policy

BeforeUpdate = Callable[[Transitions], Transitions]
"""Given a batch drawn from a replay memory, says which batch is to be learned from."""


@dataclass(frozen=True)
class Round:
    """What one round did. The loop emits it; whoever writes, draws or evaluates listens."""

    index: int
    """Counted from 1."""
    env_steps: int
    """Environment steps taken since the start of the run, this round included."""
    metrics: Metrics


@runtime_checkable
class Learner(Protocol):
    """What improves a policy: collects steps, is told their reward, learns from it."""

    @property
    def env_steps(self) -> int: ...
    @property
    def reward_scale(self) -> float: ...
    def start(self, reward: RewardFn, before_update: BeforeUpdate | None = None) -> None:
        """Told once, before the first round: SAC updates while it collects, by this reward.

        `before_update` is called with each batch drawn from a replay memory; what it returns, as many
        steps, is rewarded and learned from.
        """
        ...

    def collect(self) -> Transitions: ...
    def log_pi(self, batch: Transitions) -> Float[Tensor, "B"]:
        """Log density of the batch's own actions under the current policy; asking changes nothing."""
        ...

    def improve(self, reward: RewardFn) -> Metrics: ...
    def take_finished(self) -> list[tuple[float, int]]: ...
    def policy(self) -> Policy: ...
    def state_dict(self) -> dict[str, Any]: ...
    def load_state_dict(self, state: dict[str, Any]) -> None: ...
    def close(self) -> None: ...
