"""Whether D means what it says: D = 0.7 should be the expert in 70 % of cases.

The target is D = p_E / (p_E + p_pi), of expert and fresh policy steps in equal parts: each class weighs half
here, however many steps there are of it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import expit

BINS = 15


@dataclass(frozen=True)
class Calibration:
    """Errors of D as a probability."""

    ece: float
    """sum over bins of their weight times |mean label - mean D|: 0 is calibrated, 1 the worst."""
    brier: float
    """E[(D - label)^2]: 1/4 for D = 1/2 everywhere."""
    reliability: float
    """Of the Brier score, what calibration would take off: sum of weight (mean D - mean label)^2."""
    resolution: float
    """What telling the bins apart takes off: sum of weight (mean label - 1/2)^2."""


def calibration(
    expert: Float[np.ndarray, "P"], policy: Float[np.ndarray, "Q"], bins: int = BINS
) -> Calibration:
    """Errors of D = sigmoid(logit), in bins of equal weight.

        brier = reliability - resolution + 1/4,   up to the spread of D within bins

    NaN where there is a class without a step, or a logit that is not finite.
    Source: Murphy (1973), A New Vector Partition of the Probability Score.
    """
    logits = np.concatenate([expert, policy]).astype(np.float64)
    if not len(expert) or not len(policy) or not np.all(np.isfinite(logits)):
        return Calibration(*[float("nan")] * 4)
    label = np.repeat([1.0, 0.0], [len(expert), len(policy)])
    weight = np.repeat([0.5 / len(expert), 0.5 / len(policy)], [len(expert), len(policy)])
    order = np.argsort(logits, kind="stable")
    d, label, weight = expit(logits)[order], label[order], weight[order]
    # equal logits stay in one bin, or the order of equals would decide what is in it
    upper = np.searchsorted(logits[order], logits[order], side="right") - 1
    middle = (np.cumsum(weight) - weight / 2)[(np.searchsorted(logits[order], logits[order]) + upper) // 2]
    place = np.minimum((middle * bins).astype(int), bins - 1)
    mass = np.bincount(place, weight, bins)
    kept = mass > 0
    mean_d = np.bincount(place, weight * d, bins)[kept] / mass[kept]
    mean_label = np.bincount(place, weight * label, bins)[kept] / mass[kept]
    mass = mass[kept]
    return Calibration(
        ece=float(np.sum(mass * np.abs(mean_d - mean_label))),
        brier=float(np.sum(weight * (d - label) ** 2)),
        reliability=float(np.sum(mass * (mean_d - mean_label) ** 2)),
        resolution=float(np.sum(mass * (mean_label - 0.5) ** 2)),
    )
