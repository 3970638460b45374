"""What a learner is fed: the size of a reward, its sign, and what it pays for ending or not ending.

    survival bias   b = E[r] / (|E[r]| + sigma)

Near 1 each step pays much the same and something, so staying alive is what is learned where an episode can
end early; near -1 each step costs, and ending it is.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from irl.core import statistics


@dataclass(frozen=True)
class Hygiene:
    """A reward's scale on a set of steps."""

    mean: float
    std: float
    p1: float
    p99: float
    positive: float
    """Share of steps that pay more than 0."""
    survival_bias: float
    """In [-1, 1]."""
    terminal_mean: float
    """Mean over steps that ended an episode; NaN where none did."""
    other_mean: float
    clipped: float
    """Share beyond +-10 standard deviations of the mean, where a learner's scaling usually clips."""


CLIP = 10.0


def hygiene(reward: Float[np.ndarray, "N"], terminated: Bool[np.ndarray, "N"]) -> Hygiene:
    """The scale of `reward`; all NaN where it is empty or not finite."""
    if not len(reward) or not np.all(np.isfinite(reward)):
        return Hygiene(*[float("nan")] * 9)
    mean = float(np.mean(reward))
    std = 0.0 if statistics.is_constant(reward) else float(np.std(reward))
    size = abs(mean) + std
    low, high = np.quantile(reward, [0.01, 0.99])
    return Hygiene(
        mean=mean,
        std=std,
        p1=float(low),
        p99=float(high),
        positive=float(np.mean(reward > 0)),
        survival_bias=mean / size if size > 0 else 0.0,
        terminal_mean=float(np.mean(reward[terminated])) if terminated.any() else float("nan"),
        other_mean=float(np.mean(reward[~terminated])) if not terminated.all() else float("nan"),
        clipped=float(np.mean(np.abs(reward - mean) > CLIP * std)) if std > 0 else 0.0,
    )
