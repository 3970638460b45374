"""Discounted sums over n steps, inside an episode.

    G_n(t) = sum over k < n of gamma^k x(t + k)

A sum stops where the task ended the episode, because nothing follows. Where a time limit or the recording
cut it, something does: segments that would run past such an end are left out.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.signal import lfilter

from irl.diagnostics.stack import Layout

WHOLE = 0
"""Instead of a number of steps: one segment an episode, from its first step to its last."""


@dataclass(frozen=True, eq=False)
class Segments:
    """M sums of each of R columns, and where they come from."""

    values: Float[np.ndarray, "M R"]
    episode: Int[np.ndarray, "M"]


def segments(columns: Float[np.ndarray, "N R"], layout: Layout, gamma: float, n: int) -> Segments:
    """Every segment of `n` steps, at every start; of `WHOLE` steps, one an episode.

    Raises:
        ValueError: n is negative, or the columns are of other steps than the layout.
    Cost: one pass over the columns, whatever n is.
    """
    if n < 0 or len(columns) != layout.steps:
        raise ValueError(f"n = {n} of {len(columns)} steps, where {layout.steps} lie in episodes")
    tails = _discounted_to_the_end(np.asarray(columns, dtype=np.float64), layout, gamma)
    if n == WHOLE:
        return Segments(tails[layout.start], np.arange(len(layout.start)))
    episode = layout.episode
    left = (layout.start + layout.length)[episode] - np.arange(layout.steps)
    kept = np.flatnonzero(layout.terminated[episode] | (left >= n))
    values = tails[kept]
    inside = left[kept] > n
    values[inside] -= gamma**n * tails[kept[inside] + n]
    return Segments(values, episode[kept])


def _discounted_to_the_end(
    columns: Float[np.ndarray, "N R"], layout: Layout, gamma: float
) -> Float[np.ndarray, "N R"]:
    """G(t) = x(t) + gamma G(t + 1), each episode for itself."""
    sums = np.empty_like(columns)
    for start, length in zip(layout.start, layout.length, strict=True):
        backwards = columns[start : start + length][::-1]
        sums[start : start + length] = lfilter([1.0], [1.0, -gamma], backwards, axis=0)[::-1]
    return sums
