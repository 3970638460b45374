"""The gradients of `sac_losses`, written out: each is what autograd finds, and a test holds it."""

import torch
from jaxtyping import Float
from torch import Tensor

from irl.learners.sac_losses import EPSILON


def of_critics(qs: Float[Tensor, "N B"], target: Float[Tensor, "B"]) -> Float[Tensor, "N B"]:
    """dL/dQ_i of `critic_loss`: (Q_i - y) / B."""
    return (qs - target) / len(target)


def of_values(qs: Float[Tensor, "N B"], shares: Float[Tensor, "B"]) -> Float[Tensor, "N B"]:
    """dL/dQ_i of `actor_loss` at min_i Q_i: minus a row's share for the critic that is lowest there."""
    lowest = qs.argmin(0, keepdim=True)
    return torch.zeros_like(qs).scatter_(0, lowest, -shares.unsqueeze(0))


def of_squashed(
    action: Float[Tensor, "B A"],
    moved: Float[Tensor, "B A"],
    of_action: Float[Tensor, "B A"],
    of_log_pi: Float[Tensor, "B"],
) -> tuple[Float[Tensor, "B A"], Float[Tensor, "B A"]]:
    """dL/dmean and dL/dlog_std through `squashed`, given dL/da and dL/dlog pi; `moved` is std noise.

    dL/du = (dL/da + dL/dlog pi 2a / (1 - a^2)) (1 - a^2),   dL/dlog_std = dL/du std noise - dL/dlog pi
    """
    slope, of_log_pi = 1.0 - action.square(), of_log_pi.unsqueeze(1)
    of_mean = (of_action + of_log_pi * 2.0 * action / (slope + EPSILON)) * slope
    return of_mean, of_mean * moved - of_log_pi


def shares(like: Float[Tensor, "B"], alive: Float[Tensor, "B"] | None) -> Float[Tensor, "B"]:
    """What a row counts in `mean_alive`: 1 / B, or 1 over the number of rows in which somebody acts."""
    return torch.full_like(like, 1.0 / len(like)) if alive is None else alive / alive.sum().clamp(min=1.0)
