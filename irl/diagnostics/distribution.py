"""How far the values of a reward moved as a distribution, whichever steps they are of.

    w1     E|F_s^-1(U) - F_t^-1(U)| / sigma_s       how far a value moved, in standard deviations of before
    ks     max |F_s - F_t|                          in [0, 1]
    psi    sum over ten bins of (p - q) log(p / q)  bins of equal mass before; 0.1, 0.25 are usual limits

`aligned` takes offset and scale off first: what is left is a change of shape. Blind to steps that change
places; distances and rank correlations see those.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import ks_2samp, wasserstein_distance

from irl.core import statistics

BINS = 10
LEAST = 1e-4
"""A share of 0 counts as this: its logarithm has to be finite."""


@dataclass(frozen=True)
class Shift:
    """Three distances of two distributions of rewards; NaN where there is none."""

    w1: float
    ks: float
    psi: float
    w1_aligned: float
    """W1 with both at mean 0 and standard deviation 1."""


def shift(before: Float[np.ndarray, "N"], after: Float[np.ndarray, "M"]) -> Shift:
    """The shift from `before` to `after`; NaN where either is not finite or empty.

    Where `before` is constant, W1 in its standard deviations and PSI in its bins are undefined: NaN.
    """
    nan = float("nan")
    if not len(before) or not len(after) or not (np.isfinite(before).all() and np.isfinite(after).all()):
        return Shift(nan, nan, nan, nan)
    ks = float(np.asarray(ks_2samp(before, after, method="asymp"), dtype=np.float64)[0])
    if statistics.is_constant(before):
        return Shift(nan, ks, nan, nan)
    w1 = float(wasserstein_distance(before, after) / np.std(before))
    if statistics.is_constant(after):
        return Shift(w1, ks, psi(before, after), nan)
    aligned = wasserstein_distance(_standard(before), _standard(after))
    return Shift(w1, ks, psi(before, after), float(aligned))


def psi(before: Float[np.ndarray, "N"], after: Float[np.ndarray, "M"], bins: int = BINS) -> float:
    """Population stability index over bins that hold equal shares of `before`."""
    edges = np.unique(np.quantile(before, np.linspace(0, 1, bins + 1)[1:-1]))

    def shares(values: Float[np.ndarray, "K"]) -> Float[np.ndarray, "_"]:
        place = np.searchsorted(edges, values, side="right")
        return np.maximum(np.bincount(place, minlength=len(edges) + 1) / len(values), LEAST)

    p, q = shares(before), shares(after)
    return float(np.sum((q - p) * np.log(q / p)))


def _standard(values: Float[np.ndarray, "N"]) -> Float[np.ndarray, "N"]:
    return (values - np.mean(values)) / np.std(values)
