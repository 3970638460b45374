"""How sure a number is that was read off episodes: whole episodes are drawn again, never single steps.

Steps of one episode resemble each other, so they count as one observation. Episodes are drawn with
replacement within their stratum, whose share of the whole is part of the design.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from irl.diagnostics.segments import Segments
from irl.diagnostics.stack import Layout

DRAWS = 1000
LEVEL = 0.95


def counts(layout: Layout, draws: int, rng: np.random.Generator) -> Int[np.ndarray, "D E"]:
    """How often each episode was drawn, in each of `draws` resamples."""
    return within(layout.stratum, draws, rng)


def within(stratum: Int[np.ndarray, "E"], draws: int, rng: np.random.Generator) -> Int[np.ndarray, "D E"]:
    """The same of episodes by the number of each one's stratum."""
    drawn = np.empty((draws, len(stratum)), dtype=np.int64)
    for one in np.unique(stratum):
        there = np.flatnonzero(stratum == one)
        drawn[:, there] = rng.multinomial(len(there), np.full(len(there), 1.0 / len(there)), size=draws)
    return drawn


def correlations(sums: Segments, reference: int, drawn: Int[np.ndarray, "D E"]) -> Float[np.ndarray, "D R"]:
    """Pearson's rho of every column with the column `reference`, in every resample; NaN where undefined.

    Needs the six moments of each episode only, so a thousand resamples cost one product of matrices.
    """
    if not len(sums.values):
        return np.full((len(drawn), sums.values.shape[1]), np.nan)
    x = sums.values - np.mean(sums.values, axis=0)
    scale = np.std(x, axis=0)
    x = x / np.where(scale > 0, scale, 1.0)
    y = x[:, [reference]]
    episodes = drawn.shape[1]
    weighted = [
        drawn @ _by_episode(column, sums.episode, episodes)
        for column in (np.ones((len(x), 1)), x, y, x * x, y * y, x * y)
    ]
    n, sx, sy, sxx, syy, sxy = weighted
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = (sxx - sx * sx / n) * (syy - sy * sy / n)
        rho = (sxy - sx * sy / n) / np.sqrt(np.where(spread > 0, spread, np.nan))
    return np.clip(rho, -1.0, 1.0)


def statistic(
    measure: Callable[[np.ndarray, np.ndarray], float],
    sums: Segments,
    pair: tuple[int, int],
    drawn: Int[np.ndarray, "D E"],
) -> Float[np.ndarray, "D"]:
    """Any measure of two columns in every resample, the slow way."""
    rows = [np.flatnonzero(sums.episode == episode) for episode in range(drawn.shape[1])]
    found = []
    for times in drawn:
        chosen = np.concatenate([np.tile(rows[e], times[e]) for e in np.flatnonzero(times)])
        found.append(measure(sums.values[chosen, pair[0]], sums.values[chosen, pair[1]]))
    return np.array(found)


def interval(values: Float[np.ndarray, "D"], level: float = LEVEL) -> tuple[float, float]:
    """The central `level` of the resamples; NaN where fewer than nine in ten are defined."""
    there = values[np.isfinite(values)]
    if len(there) < 0.9 * len(values) or not len(there):
        return float("nan"), float("nan")
    low, high = np.quantile(there, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def _by_episode(
    columns: Float[np.ndarray, "M R"], episode: Int[np.ndarray, "M"], episodes: int
) -> Float[np.ndarray, "E R"]:
    """Sums of the rows of each episode; rows lie in the order of episodes."""
    sums = np.zeros((episodes, columns.shape[1]))
    if len(episode):
        first = np.flatnonzero(np.diff(episode, prepend=-1))
        sums[episode[first]] = np.add.reduceat(columns, first, axis=0)
    return sums
