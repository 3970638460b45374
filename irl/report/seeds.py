"""Several seeds in one number: the interquartile mean, and how sure it is.

    IQM = mean of the values between the first and the third quartile, each at its share

Source: Agarwal et al. (2021), arXiv:2108.13264.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from irl.core.rng import stream

DRAWS = 2000


def iqm(values: Float[np.ndarray, "*D N"]) -> Float[np.ndarray, "*D"]:
    """The mean of the middle half along the last axis; values at its ends count in part.

    >>> float(iqm(np.array([0.0, 1.0, 2.0, 9.0])))
    1.5
    """
    n = values.shape[-1]
    edge = np.arange(n + 1) / n
    weight = np.clip(np.minimum(edge[1:], 0.75) - np.maximum(edge[:-1], 0.25), 0.0, None)
    return np.asarray(np.sum(np.sort(values, axis=-1) * weight, axis=-1) / np.sum(weight))


def interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Where 95 % of redrawn sets of seeds put the interquartile mean; None of a single one."""
    if len(values) < 2:
        return None
    numbers = np.asarray(values, dtype=np.float64)
    drawn = numbers[stream(0, "seeds of a report").integers(len(numbers), size=(DRAWS, len(numbers)))]
    low, high = np.quantile(iqm(drawn), [0.025, 0.975])
    return float(low), float(high)
