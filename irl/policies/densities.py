"""The log density of actions that the environment has seen, under the policies that made them.

A policy draws u ~ N(mean, std) and the environment sees a function of u. AIRL divides by the density of
what was seen (`irl.discriminators.airl`), the expert's actions and the policy's alike.

    clipped    a = clip(u, low, high)         log p(a) = log N(a)                         within the bounds
                                              log p(a) = log P(u <= low), log P(u >= high)         at them
    squashed   a = center + half tanh(u)      log p(a) = log N(u) - log(1 - tanh(u)^2) - log half

each summed over the dimensions of an action. At a bound `clipped` is a mass and not a density: clipping
puts all that would lie outside there. N(a) at the bound, which is what a library that is handed a clipped
action computes, counts only what would fall within a hair's breadth of it; a policy could then raise
-log p(a) without end by moving its mean outwards, which changes nothing that the environment sees.
"""

import math

import torch
from jaxtyping import Float
from torch import Tensor
from torch.special import log_ndtr

EDGE = 0.01
"""An action so near to a bound, as a share of the box, counts as at it: other policies than a Gaussian
saturate without touching it."""

OPEN = 1e-6
"""How far within +-1 an action is taken before its atanh, which is infinite there."""

_LOG_ROOT_2_PI = 0.5 * math.log(2.0 * math.pi)


def clipped(
    action: Float[Tensor, "B A"],
    mean: Float[Tensor, "B A"],
    log_std: Float[Tensor, "B A"],
    low: Float[Tensor, "A"],
    high: Float[Tensor, "A"],
) -> Float[Tensor, "B"]:
    """The log of p(clip(u)), u ~ N(mean, std): a density within the bounds, a mass from `EDGE` of them on.

    Sums to one: over the inside by area, and over each bound as a point. A box without an end has no share
    of itself: there only an action on the bound that it has counts as at it.
    """
    width = high - low
    margin = torch.where(width.isfinite(), EDGE * width, 0.0)
    low, high = low + margin, high - margin
    at_low, at_high = action <= low, action >= high
    std = log_std.exp()
    z = (action - mean) / std
    inside = -0.5 * z.square() - log_std - _LOG_ROOT_2_PI
    # bounds only where they count: far off one's gradient is NaN, and 0 times that is too
    of_low = log_ndtr((torch.where(at_low, low, mean) - mean) / std)
    of_high = log_ndtr((mean - torch.where(at_high, high, mean)) / std)
    of_dimensions = torch.where(at_low, of_low, torch.where(at_high, of_high, inside))
    return of_dimensions.sum(1)


def squashed(
    action: Float[Tensor, "B A"],
    mean: Float[Tensor, "B A"],
    log_std: Float[Tensor, "B A"],
    half: Float[Tensor, "A"],
) -> Float[Tensor, "B"]:
    """The log of p(half tanh(u)), u ~ N(mean, std); `action` is tanh(u), within [-1, 1].

    An action nearer to a bound than `OPEN` is taken as that far from it: a demonstration may lie on it.
    log(1 - tanh(u)^2) = 2 (log 2 - u - log(1 + exp(-2u))), which keeps its digits where tanh is 1.
    """
    u = torch.atanh(action.clamp(-1.0 + OPEN, 1.0 - OPEN))
    z = (u - mean) / log_std.exp()
    log_normal = -0.5 * z.square() - log_std - _LOG_ROOT_2_PI
    log_slope = 2.0 * (math.log(2.0) - u - torch.nn.functional.softplus(-2.0 * u))
    return (log_normal - log_slope - half.log()).sum(1)
