"""How a discriminator fares: on the demonstrations it learned from, on others, and on fresh policy steps.

D = sigmoid(logit), expert = label 1, both classes at half the weight. A discriminator that is far better on
the demonstrations it was trained on than on held-out ones knows them by heart, and its reward pays for being
them.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import expit

from irl.core import statistics
from irl.diagnostics.calibration import calibration

SURE = 5.0
"""A logit beyond this is D within 0.7 % of 0 or 1, where its slope is gone."""


@dataclass(frozen=True)
class Health:
    """A discriminator on expert and policy steps."""

    auroc: float
    """Share of pairs in which the expert's step has the higher logit; 0.5 is blind."""
    balanced_accuracy: float
    """Mean of the shares called right at D = 1/2."""
    bce: float
    """-(E_expert[log D] + E_policy[log(1 - D)]) / 2, nats; log 2 is blind."""
    jsd_bound: float
    """log 2 - bce, nats: the Jensen-Shannon divergence of expert and policy is at least this, by steps that
    were not learned from; by those that were it is no bound. At 0 the policy has converged, or the
    discriminator is blind; below 0 it is worse than blind."""
    entropy: float
    """Of D, nats, both classes at half the weight; log 2 is unsure everywhere."""
    ece: float
    brier: float
    reliability: float
    resolution: float
    saturated: float
    """Share of steps with |logit| > 5."""


def health(expert: Float[np.ndarray, "P"], policy: Float[np.ndarray, "Q"]) -> Health:
    """Health of the logits of P expert and Q policy steps; NaN where a class is empty or not finite."""
    e, p = np.asarray(expert, dtype=np.float64), np.asarray(policy, dtype=np.float64)
    if not len(e) or not len(p) or not (np.all(np.isfinite(e)) and np.all(np.isfinite(p))):
        return Health(*[float("nan")] * 10)
    bce = (np.mean(np.logaddexp(0.0, -e)) + np.mean(np.logaddexp(0.0, p))) / 2.0
    right = (np.mean(e > 0) + np.mean(e == 0) / 2 + np.mean(p < 0) + np.mean(p == 0) / 2) / 2.0
    scores = calibration(e, p)
    return Health(
        auroc=statistics.auroc(e, p),
        balanced_accuracy=float(right),
        bce=float(bce),
        jsd_bound=math.log(2.0) - float(bce),
        entropy=float(np.mean(_entropy(e)) + np.mean(_entropy(p))) / 2.0,
        ece=scores.ece,
        brier=scores.brier,
        reliability=scores.reliability,
        resolution=scores.resolution,
        saturated=float(np.mean(np.abs(e) > SURE) + np.mean(np.abs(p) > SURE)) / 2.0,
    )


def _entropy(logits: Float[np.ndarray, "B"]) -> Float[np.ndarray, "B"]:
    """-D log D - (1 - D) log(1 - D) = log(1 + e^h) - h D, nats."""
    return np.logaddexp(0.0, logits) - logits * expit(logits)
