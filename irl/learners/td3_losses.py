"""The equations of TD3, each a function of a batch, and their gradients; a test holds each to autograd's.

Source: Fujimoto et al. 2018 (arXiv:1802.09477), algorithm 1 and equations 10 and 14; "alive" as in
`irl.learners.sac_losses`.
"""

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn.functional import mse_loss

from irl.learners.sac_losses import mean_alive


def smoothed(
    action: Float[Tensor, "B A"], noise: Float[Tensor, "B A"], std: float, clip: float
) -> Float[Tensor, "B A"]:
    """The next action clip(a + clip(std noise, -c, c), -1, 1): like actions are worth the like."""
    return (action + (std * noise).clamp(-clip, clip)).clamp(-1.0, 1.0)


def critic_loss(qs: Float[Tensor, "N B"], target: Float[Tensor, "B"]) -> Float[Tensor, ""]:
    """L = sum_i E[(Q_i - y)^2]."""
    return len(qs) * mse_loss(qs, target.expand_as(qs))


def of_critics(qs: Float[Tensor, "N B"], target: Float[Tensor, "B"]) -> Float[Tensor, "N B"]:
    """dL/dQ_i of `critic_loss`: 2 (Q_i - y) / B."""
    return 2.0 * (qs - target) / len(target)


def actor_loss(q: Float[Tensor, "B"], alive: Float[Tensor, "B"] | None) -> Float[Tensor, ""]:
    """L = -E[Q_1(s, pi(s))], over the states in which somebody acts."""
    return -mean_alive(q, alive)


def of_first(qs: Float[Tensor, "N B"], shares: Float[Tensor, "B"]) -> Float[Tensor, "N B"]:
    """dL/dQ_i of `actor_loss`: minus a row's share for the first critic, 0 for the others."""
    gradient = torch.zeros_like(qs)
    gradient[0] = -shares
    return gradient


def of_tanh(action: Float[Tensor, "B A"], of_action: Float[Tensor, "B A"]) -> Float[Tensor, "B A"]:
    """dL/du through a = tanh(u): dL/da (1 - a^2)."""
    return of_action * (1.0 - action.square())
