"""What several runs on several tasks come to: averages with intervals, and which of two methods is better.

Scores come in groups, a group a task. An interval says what other seeds on the same tasks would give:
resamples are drawn within each task (stratified bootstrap), and other tasks are not spoken of.

Source: Agarwal et al. (2021), arXiv:2108.13264.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from irl.core.statistics import auroc, iqm, iqm_rows

DRAWS = 10_000
"""Resamples."""
Groups = Sequence[Float[np.ndarray, "_"]]


@dataclass(frozen=True)
class Estimate:
    """A number and the central 95 % of its resamples; NaN where some task has one run only."""

    value: float
    low: float
    high: float


def averages(groups: Groups, rng: np.random.Generator, draws: int = DRAWS) -> tuple[Estimate, Estimate]:
    """Interquartile mean and mean over all runs of all tasks.

    NaN where there is no run or a score is not finite.
    """
    together = np.concatenate([np.empty(0), *groups])
    mean = float(together.mean()) if len(together) else float("nan")
    if not _resamplable(groups):
        return Estimate(iqm(together), np.nan, np.nan), Estimate(mean, np.nan, np.nan)
    drawn = _resampled(groups, rng, draws)
    return _estimate(iqm(together), iqm_rows(drawn)), _estimate(mean, drawn.mean(1))


def improvement(a: Groups, b: Groups, rng: np.random.Generator, draws: int = DRAWS) -> Estimate:
    """Probability that a run of `a` scores above one of `b`, ties counted half, mean over the tasks.

        P = 1/M sum_m  1/(N K) sum_ij  [a_mi > b_mj] + [a_mi = b_mj] / 2

    Args:
        a: of M tasks, N scores each.
        b: of the same tasks in the same order, K scores each.
    Raises:
        ValueError: the numbers of tasks differ.
    """
    if len(a) != len(b):
        raise ValueError(f"expected the same tasks of both: {len(a)} != {len(b)}")
    value = float(np.mean([auroc(x, y) for x, y in zip(a, b, strict=True)])) if a else float("nan")
    if not _resamplable([*a, *b]):
        return Estimate(value, np.nan, np.nan)
    drawn = np.zeros(draws)
    for x, y in zip(a, b, strict=True):
        wins = (x[:, None] > y) + (x[:, None] == y) / 2
        i, j = rng.integers(len(x), size=(draws, len(x))), rng.integers(len(y), size=(draws, len(y)))
        drawn += wins[i[:, :, None], j[:, None, :]].mean((1, 2))
    return _estimate(value, drawn / len(a))


def steps_to(
    curve: Sequence[Sequence[float | int]], share: float, score: Callable[[float | int], float]
) -> float | None:
    """Steps of the first evaluation at or above `share` of the expert's score; None where there is none."""
    return next((float(steps) for steps, value in curve if score(value) >= share), None)


def middle(values: Sequence[float | None]) -> float | None:
    """The median, where None is later than any number; None where that is the median, or in it.

    >>> middle([30.0, None, 10.0]), middle([None, None, 10.0])
    (30.0, None)
    """
    ordered = sorted(float("inf") if value is None else value for value in values)
    found = float(np.median(ordered)) if ordered else float("inf")
    return None if np.isinf(found) else found


def _resamplable(groups: Groups) -> bool:
    return bool(groups) and all(len(group) > 1 and np.isfinite(group).all() for group in groups)


def _resampled(groups: Groups, rng: np.random.Generator, draws: int) -> Float[np.ndarray, "D N"]:
    return np.concatenate([g[rng.integers(len(g), size=(draws, len(g)))] for g in groups], axis=1)


def _estimate(value: float, drawn: Float[np.ndarray, "D"]) -> Estimate:
    low, high = np.quantile(drawn, [0.025, 0.975])
    return Estimate(value, float(low), float(high))
