"""The equations of soft actor-critic, each a function of a batch.

Source: Haarnoja et al. 2018 (arXiv:1812.05905), equations 5 to 9 and 18, appendix C; "alive" is DAC's
(Kostrikov et al. 2019, arXiv:1809.02925, section 4.2): nobody acts in the absorbing state.
"""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn.functional import mse_loss

EPSILON = 1e-6
"""Keeps log(1 - a^2) finite; Stable-Baselines3 has the same."""


def squashed(
    mean: Float[Tensor, "B A"], log_std: Float[Tensor, "B A"], noise: Float[Tensor, "B A"]
) -> tuple[Float[Tensor, "B A"], Float[Tensor, "B"]]:
    """Actions a = tanh(mean + std noise) within [-1, 1], and log pi(a) = sum log N(u) - log(1 - a^2)."""
    action = torch.tanh(mean + log_std.exp() * noise)
    log_normal = (-0.5 * noise.square() - log_std).sum(1) - 0.5 * math.log(2 * math.pi) * mean.shape[1]
    return action, log_normal - torch.log(1.0 - action.square() + EPSILON).sum(1)


def td_target(
    reward: Float[Tensor, "B"],
    next_value: Float[Tensor, "*M B"],
    ended: Bool[Tensor, "B"],
    gamma: float,
) -> Float[Tensor, "*M B"]:
    """Y = r + gamma V(s'), where V is 0 after a termination; a time limit is none."""
    return reward + gamma * next_value * (~ended)


def soft_value(
    q: Float[Tensor, "*M B"],
    log_pi: Float[Tensor, "B"],
    temperature: Float[Tensor, ""],
    alive: Float[Tensor, "B"] | None,
) -> Float[Tensor, "*M B"]:
    """V(s) = Q(s, a) - alpha log pi(a|s); without the entropy where nobody acts."""
    return q - temperature * (log_pi if alive is None else alive * log_pi)


def critic_loss(qs: Float[Tensor, "N B"], target: Float[Tensor, "B"]) -> Float[Tensor, ""]:
    """L = 1/2 sum_i E[(Q_i - y)^2]."""
    return 0.5 * len(qs) * mse_loss(qs, target.expand_as(qs))


def actor_loss(
    q: Float[Tensor, "B"],
    log_pi: Float[Tensor, "B"],
    temperature: Float[Tensor, ""],
    alive: Float[Tensor, "B"] | None,
) -> Float[Tensor, ""]:
    """L = E[alpha log pi(a|s) - Q(s, a)], over the states in which somebody acts."""
    return mean_alive(temperature * log_pi - q, alive)


def temperature_loss(
    log_temperature: Float[Tensor, "1"],
    log_pi: Float[Tensor, "B"],
    target_entropy: float,
    alive: Float[Tensor, "B"] | None,
) -> Float[Tensor, ""]:
    """L = -log alpha E[log pi + target entropy]: alpha rises while the entropy is below its target."""
    return -(log_temperature * mean_alive(log_pi.detach() + target_entropy, alive)).sum()


def mean_alive(values: Float[Tensor, "B"], alive: Float[Tensor, "B"] | None) -> Float[Tensor, ""]:
    """The mean over the rows where `alive` is 1; 0 when there is none."""
    return values.mean() if alive is None else (values * alive).sum() / alive.sum().clamp(min=1.0)
