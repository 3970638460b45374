"""DARD, a named reference: like EPIC, with next states that the dynamics make.

    T(R)(s, a, s') = R(s, a, s') + E[gamma R(s', A, S'') - R(s, A, S') - gamma R(S', A, S'')]
    S' ~ T(s, A),   S'' ~ T(s', A),   the same A, S' and S'' in every term

Shared samples take a potential off exactly. (S', A, S'') is still no step of the task, but near to one. On
MuJoCo, whose forward reward is nearly a potential difference, it finds running backwards next to forwards.

Source: Wulfe et al. (2022), arXiv:2201.10081.
"""

from collections.abc import Callable

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.types import Transitions
from irl.diagnostics.epic import going_on
from irl.diagnostics.stack import Given, read

Dynamics = Callable[[Tensor, Tensor], Tensor]
"""Next observations of observations and actions, one draw a row: a simulator or a learned model."""


def canonical(
    reward: Given,
    batch: Transitions,
    actions: Float[Tensor, "M A"],
    dynamics: Dynamics,
    gamma: float,
) -> Float[np.ndarray, "B"]:
    """T(R) of each step of `batch`, the expectation over the M `actions` and one draw of the dynamics each.

    Cost: 3 B M rewards and 2 B M steps of the dynamics.
    """
    n, m = len(batch), len(actions)
    now, ahead = (states.repeat_interleave(m, 0) for states in (batch.obs, batch.next_obs))
    action = actions.repeat(n, 1)
    after_now, after_ahead = dynamics(now, action), dynamics(ahead, action)

    def mean(start: Tensor, end: Tensor) -> Float[np.ndarray, "B"]:
        flags = torch.zeros(n * m, dtype=torch.bool)
        return read(reward, Transitions(start, action, end, flags, flags)).reshape(n, m).mean(1)

    own = read(reward, going_on(batch))
    return (
        own + gamma * mean(ahead, after_ahead) - mean(now, after_now) - gamma * mean(after_now, after_ahead)
    )
