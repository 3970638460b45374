"""How two columns of numbers agree, and how well a number separates two groups.

Undefined is NaN, never 0: a correlation with a constant is not "no correlation". No function here
warns, and every one takes its averages in float64.
"""

import numpy as np
from jaxtyping import Float
from scipy.stats import kendalltau, rankdata

FEW = 5
"""Runs below which an interval over them is hardly one: of two it is the two."""
ROUNDING = 1e-13
"""A spread below this share of the largest magnitude is what summing terms in float64 leaves."""


def is_constant(values: Float[np.ndarray, "N"]) -> bool:
    """Whether all values are one number, up to the rounding of a sum; so are none and one."""
    if len(values) < 2:
        return True
    return bool(np.ptp(values) <= ROUNDING * np.max(np.abs(values)))


def pearson(a: Float[np.ndarray, "N"], b: Float[np.ndarray, "N"]) -> float:
    """Linear correlation, in [-1, 1].

        rho = sum((a - mean(a)) (b - mean(b))) / (|a - mean(a)| |b - mean(b)|)

    NaN where either is constant or holds a number that is not finite.
    """
    if not _comparable(a, b):
        return float("nan")
    x, y = _direction(a), _direction(b)
    return float(np.clip(np.dot(x, y), -1.0, 1.0))


def spearman(a: Float[np.ndarray, "N"], b: Float[np.ndarray, "N"]) -> float:
    """Correlation of the ranks, in [-1, 1]; equal values share the average of their ranks.

    NaN where either is constant or holds a number that is not finite.
    """
    if not _comparable(a, b):
        return float("nan")
    return pearson(rankdata(a), rankdata(b))


def kendall(a: Float[np.ndarray, "N"], b: Float[np.ndarray, "N"]) -> float:
    """Kendall's tau-b, in [-1, 1]: pairs in the same order less pairs in the other, ties allowed for.

    Of all pairs of steps, a share (1 - tau) / 2 is in the other order, where there are no ties.
    NaN where either is constant or holds a number that is not finite. Cost: N log N.
    """
    if not _comparable(a, b):
        return float("nan")
    return float(np.asarray(kendalltau(a, b), dtype=np.float64)[0])


def auroc(positive: Float[np.ndarray, "P"], negative: Float[np.ndarray, "N"]) -> float:
    """Probability that a positive outranks a negative one, ties counted half: 0.5 = no separation.

        A = (sum of the ranks of the positive - P (P + 1) / 2) / (P N)        (Mann-Whitney's U / P N)

    NaN where either is empty or holds a number that is not finite.
    """
    n_positive, n_negative = len(positive), len(negative)
    both = np.concatenate([positive, negative]).astype(np.float64)
    if n_positive == 0 or n_negative == 0 or not np.all(np.isfinite(both)):
        return float("nan")
    rank_sum = float(np.sum(rankdata(both)[:n_positive]))
    return (rank_sum - n_positive * (n_positive + 1) / 2) / (n_positive * n_negative)


def _comparable(a: Float[np.ndarray, "N"], b: Float[np.ndarray, "N"]) -> bool:
    finite = np.all(np.isfinite(a)) and np.all(np.isfinite(b))
    return bool(finite) and not is_constant(a) and not is_constant(b)


def _direction(values: Float[np.ndarray, "N"]) -> Float[np.ndarray, "N"]:
    # dividing before centring keeps the squares of very large and very small numbers finite
    scaled = np.asarray(values, dtype=np.float64)
    scaled = scaled / np.max(np.abs(scaled))
    centred = scaled - np.mean(scaled)
    centred = centred / np.max(np.abs(centred))
    return centred / np.linalg.norm(centred)


def iqm(values: Float[np.ndarray, "N"]) -> float:
    """Interquartile mean: the mean of what is left when a quarter is cut off at each end, whole values only.

    NaN where there is none or one of them is not finite.

    >>> iqm(np.array([0.0, 1.0, 3.0, 100.0]))
    2.0

    Source: Agarwal et al. (2021), arXiv:2108.13264.
    """
    if len(values) == 0 or not np.all(np.isfinite(values)):
        return float("nan")
    return float(iqm_rows(np.asarray(values, dtype=np.float64)[None])[0])


def iqm_rows(rows: Float[np.ndarray, "D N"]) -> Float[np.ndarray, "D"]:
    """`iqm` of each row of finite numbers, N at least 1."""
    n = rows.shape[1]
    cut = n // 4
    return np.sort(rows, axis=1)[:, cut : n - cut].mean(1)


def iqm_interval(
    values: Float[np.ndarray, "N"], rng: np.random.Generator, draws: int = 2000, level: float = 0.95
) -> tuple[float, float]:
    """The central `level` of the interquartile means of resamples with replacement (percentile bootstrap).

    NaN where there are fewer than two values or one is not finite: one run says nothing of another.

    Source: Agarwal et al. (2021), arXiv:2108.13264.
    """
    if len(values) < 2 or not np.all(np.isfinite(values)):
        return float("nan"), float("nan")
    drawn = rng.integers(len(values), size=(draws, len(values)))
    means = iqm_rows(np.asarray(values, dtype=np.float64)[drawn])
    low, high = np.quantile(means, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)
