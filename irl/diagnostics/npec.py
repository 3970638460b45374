"""NPEC, a named reference: the nearest reward that asks for the same, by least squares.

    min over lambda >= 0, c, theta of |lambda R + c + gamma Phi(s') - Phi(s) - R'|  /  the same at lambda = 0

Phi(s) = phi(s) . theta in the span of the features, 0 after a termination. 0: R' is R up to scale, offset and
shaping; 1: R says nothing of R'. With potentials of that span the minimum is one regression: with X and X'
what offset and potentials leave of R and R', the ratio is sqrt(1 - max(rho(X, X'), 0)^2).

Differs from the paper: a span in place of a network, so the minimum is exact and needs no training; the
norm is the root mean square, in which the distance is the same both ways.
Source: Gleave et al. (2021), arXiv:2006.13900.
"""

import math

import numpy as np
from jaxtyping import Float

from irl.diagnostics.stack import Stack
from irl.diagnostics.values import FeatureMap, in_parts


def left_over(
    rewards: Float[np.ndarray, "N R"], steps: Stack, features: FeatureMap, gamma: float
) -> Float[np.ndarray, "N R"]:
    """What the best offset and potential leave of each reward.

    Cost: two passes over the features and one F x F solve, shared by all rewards.
    """
    columns = np.asarray(rewards, dtype=np.float64)
    size = 1 + features(steps.batch.obs[:1].numpy()).shape[1]
    gram, cross = np.zeros((size, size)), np.zeros((size, columns.shape[1]))
    rows = np.arange(len(columns))
    for part, now, ahead in in_parts(steps, rows, features):
        potentials = np.column_stack([np.ones(len(part)), gamma * ahead - now])
        gram += potentials.T @ potentials
        cross += potentials.T @ columns[part]
    weights = np.linalg.lstsq(gram, cross, rcond=1e-13)[0]
    left = np.empty_like(columns)
    for part, now, ahead in in_parts(steps, rows, features):
        left[part] = columns[part] - weights[0] - (gamma * ahead - now) @ weights[1:]
    return left


def of_correlation(rho: float) -> float:
    """The distance of what is left: sqrt(1 - max(rho, 0)^2), in [0, 1]."""
    return math.sqrt(max(0.0, 1.0 - max(rho, 0.0) ** 2)) if math.isfinite(rho) else float("nan")
