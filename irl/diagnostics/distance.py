"""How far two rewards are apart: 0 asks for the same, 1 for the opposite.

    D(X, Y) = sqrt((1 - rho(X, Y)) / 2),   X, Y what is left of the rewards once what does not matter is off

A distance means little without its own error: `self_error` is the distance that the same computation finds
between the reference and the reference with random shaping, which asks for the same. One below it says
nothing, and is called not distinguishable.

Source: Gleave et al. (2021), arXiv:2006.13900 (the Pearson distance).
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from irl.core import statistics

NAN = float("nan")
LEFT = 3e-5
"""A reward of which less than this share is left once its value function is off has nothing left."""


@dataclass(frozen=True)
class Distance:
    """One distance, how sure it is, and what its computation can tell apart."""

    name: str
    value: float
    """In [0, 1]; NaN, with a reason, where it is undefined."""
    low: float = NAN
    high: float = NAN
    """95 % interval over episodes; NaN where a kind of play has only one."""
    self_error: float = NAN
    """Invariance: of the reference to itself with random shaping as large as itself; ideally 0."""
    negation: float = NAN
    """Sensitivity: of the reference to its negation; ideally 1."""
    random: float = NAN
    """Sensitivity: of the reference to a random network."""
    n: int | None = None
    """Steps of a segment, 0 for whole episodes, None where there are no segments."""
    size: int = 0
    """How many segments, steps or episodes it was taken over."""
    episodes: int = 0
    """From how many episodes they came: what the interval rests on."""
    reason: str | None = None
    """Why it is NaN."""

    @property
    def distinguishable(self) -> bool | None:
        """Whether it is above its own error; None where either is not known."""
        if math.isnan(self.value) or math.isnan(self.self_error):
            return None
        return self.value > self.self_error

    @property
    def shown(self) -> str:
        """As a person reads it: `0.31`, `not distinguishable` or `undefined`."""
        if math.isnan(self.value):
            return "undefined"
        return "not distinguishable" if self.distinguishable is False else f"{self.value:.3f}"


def of_correlation(rho: float) -> float:
    """Distance of a correlation in [-1, 1]; NaN stays NaN."""
    return math.sqrt(max(0.0, (1.0 - rho) / 2.0)) if math.isfinite(rho) else NAN


def pearson_distance(a: Float[np.ndarray, "M"], b: Float[np.ndarray, "M"]) -> float:
    """The distance of two columns. Exact near 0, where 1 - rho would have lost its digits.

        sqrt((1 - rho) / 2) = |x - y| / 2,   x and y the centred columns at length 1

    NaN where either is constant or not finite.
    """
    finite = bool(np.all(np.isfinite(a)) and np.all(np.isfinite(b)))
    if not finite or statistics.is_constant(a) or statistics.is_constant(b):
        return NAN
    return float(np.linalg.norm(_unit(a) - _unit(b))) / 2.0


def pearson_distances(columns: Float[np.ndarray, "M R"]) -> Float[np.ndarray, "R R"]:
    """All pairs of columns; NaN beside a constant one. 1 - rho loses digits below about 1e-7."""
    units = np.stack([_unit(column) for column in columns.T], axis=1) if columns.size else columns
    distances = np.sqrt(np.clip((1.0 - units.T @ units) / 2.0, 0.0, 1.0))
    np.fill_diagonal(distances, 0.0)
    undefined = np.array([statistics.is_constant(column) for column in columns.T], dtype=bool)
    distances[undefined, :] = distances[:, undefined] = NAN
    return distances


def why_undefined(
    name: str, raw: Float[np.ndarray, "N"], left: Float[np.ndarray, "M"], unit: str = "steps"
) -> str | None:
    """Why there is no distance to a reward: `raw` as given, `left` once what does not matter is off.

    None where there is one. Zero variance is a reason and never a distance of 0.
    """
    if not np.all(np.isfinite(raw)):
        return f"{name} is not finite on {int(np.sum(~np.isfinite(raw)))} of these {len(raw)} steps"
    if len(left) < 2:
        return f"a distance needs two {unit} or more, there are {len(left)}"
    if not np.any(raw):
        return f"{name} is 0 on these {unit}"
    if np.std(left) <= LEFT * np.max(np.abs(raw)):
        constant = statistics.is_constant(raw)
        return f"{name} is {'constant' if constant else 'nothing but shaping'} on these {unit}"
    return None


def _unit(column: Float[np.ndarray, "M"]) -> Float[np.ndarray, "M"]:
    centred = np.asarray(column, dtype=np.float64) - np.mean(column, dtype=np.float64)
    length = float(np.linalg.norm(centred))
    return centred / length if length > 0 else centred
