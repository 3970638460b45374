"""The equations of PPO's gradient step, each a function of a batch, and the derivative each is used by.

Source: Schulman et al. 2017 (arXiv:1707.06347), equations 7 and 9; the clipped value and the stopping by
approximate KL are those of Stable-Baselines3.
"""

import math

import torch
from jaxtyping import Float
from torch import Tensor


def log_density(z: Float[Tensor, "B A"], log_std: Float[Tensor, "A"]) -> Float[Tensor, "B"]:
    """Log N(a; mean, std) = -sum(z^2 / 2 + log_std + log(2 pi) / 2), z = (a - mean) / std."""
    return -0.5 * z.square().sum(1) - log_std.sum() - 0.5 * math.log(2 * math.pi) * z.shape[1]


def entropy(log_std: Float[Tensor, "A"]) -> Float[Tensor, ""]:
    """Of a Gaussian: sum(log_std + log(2 pi e) / 2). Its derivative in each log_std is 1."""
    return log_std.sum() + 0.5 * math.log(2 * math.pi * math.e) * len(log_std)


def surrogate(
    advantage: Float[Tensor, "B"], ratio: Float[Tensor, "B"], clip: float
) -> tuple[Float[Tensor, "B"], Float[Tensor, "B"]]:
    """min(rho A, clip(rho, 1 - eps, 1 + eps) A), and its derivative in log pi: rho A where nothing is cut."""
    free, held = advantage * ratio, advantage * ratio.clamp(1.0 - clip, 1.0 + clip)
    return torch.minimum(free, held), free * (free <= held)


def value_error(
    value: Float[Tensor, "B"], old: Float[Tensor, "B"], returns: Float[Tensor, "B"], clip: float | None
) -> tuple[Float[Tensor, "B"], Float[Tensor, "B"]]:
    """(V' - R)^2 and its derivative in V; V' = V, or V held within `clip` of what it was."""
    if clip is None:
        error = value - returns
        return error.square(), 2.0 * error
    moved = value - old
    error = old + moved.clamp(-clip, clip) - returns
    return error.square(), 2.0 * error * (moved.abs() <= clip)


def approximate_kl(log_ratio: Float[Tensor, "B"]) -> Float[Tensor, ""]:
    """E[rho - 1 - log rho] >= 0: of the old policy from the new one, over the old one's actions.

    Source: Schulman, "Approximating KL divergence" (2020), estimator k3, as in Stable-Baselines3.
    """
    return (log_ratio.exp() - 1.0 - log_ratio).mean()
