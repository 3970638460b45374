"""A reward, and what the learner's own entropy pays beside it.

    r'(s, a, s') = r(s, a, s') - temperature log pi(a|s),      log pi within +-bound

Its undiscounted sum is the objective of maximum-entropy reinforcement learning (Haarnoja et al. 2018,
arXiv:1801.01290, eq. 1). A reward learned by AIRL is of that kind, at a temperature of 1: its policy was paid
f - log pi (`irl.discriminators.airl`). Without the entropy the same reward is another objective, whose
optimum takes one action for sure.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.types import RewardFn, Transitions

BOUND = 10.0
"""Log pi is kept within this of 0 where a reward does not say beside which bound it was learned."""


@dataclass(frozen=True)
class Entropic:
    """A reward of a batch that the learner has just played; a drawn action is asked for its log pi anew."""

    reward: RewardFn
    log_pi: Callable[[Transitions], Tensor]
    """Log density of a batch's own actions under the learner as it is."""
    temperature: float
    """What a nat of entropy pays, in units of the reward."""
    bound: float = BOUND

    @torch.no_grad()
    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        """One number a row."""
        log_pi = self.log_pi(batch).clamp(-self.bound, self.bound)
        return self.reward(batch) - self.temperature * log_pi
