"""The straight line through one kind of play, with how sure its slope is.

slope = cov(x, y) / var(x)          drawn again by episode (`irl.diagnostics.bootstrap`)
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from irl.core import statistics
from irl.diagnostics import bootstrap

NAN = float("nan")


@dataclass(frozen=True)
class Line:
    """y = slope x + intercept; NaN where x or y does not vary."""

    slope: float
    low: float
    high: float
    """Where 95 % of redrawn sets of episodes put the slope; NaN of a single episode."""
    intercept: float
    pearson: float
    size: int
    episodes: int


def line(
    x: Float[np.ndarray, "N"],
    y: Float[np.ndarray, "N"],
    episode: Int[np.ndarray, "N"],
    rng: np.random.Generator,
    draws: int = 500,
) -> Line:
    """The least-squares line; `episode` says which steps belong together."""
    every = np.unique(episode)
    rho = statistics.pearson(x, y)
    if not np.isfinite(rho):
        return Line(NAN, NAN, NAN, NAN, NAN, len(x), len(every))
    middle = float(np.mean(x)), float(np.mean(y))
    u, v = x - middle[0], y - middle[1]
    slope = float(np.dot(u, v) / np.dot(u, u))
    place = np.searchsorted(every, episode)
    sums = np.column_stack(
        [np.bincount(place, weights=w, minlength=len(every)) for w in (np.ones_like(u), u, v, u * u, u * v)]
    )
    low, high = NAN, NAN
    if len(every) > 1:
        drawn = rng.multinomial(len(every), np.full(len(every), 1.0 / len(every)), size=draws) @ sums
        n, su, sv, suu, suv = drawn.T
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high = bootstrap.interval((suv - su * sv / n) / (suu - su * su / n))
    return Line(slope, low, high, middle[1] - slope * middle[0], rho, len(x), len(every))
