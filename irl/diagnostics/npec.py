"""NPEC, a named reference: the nearest reward that asks for the same, by least squares.

    min over lambda >= 0, c, theta of |lambda R + c + gamma Phi(s') - Phi(s) - R'|  /  the same at lambda = 0

Phi(s) = phi(s) . theta in the span of the features, 0 after a termination. 0: R' is R up to scale, offset and
shaping; 1: R says nothing of R'. With potentials of that span the minimum is one regression.

Differs from the paper: a span in place of a network, so the minimum is exact and needs no training; the
norm is the root mean square.
Source: Gleave et al. (2021), arXiv:2006.13900.
"""

import numpy as np
from jaxtyping import Float

from irl.diagnostics.stack import Stack
from irl.diagnostics.values import FeatureMap, in_parts


def npec(
    rewards: Float[np.ndarray, "N R"], steps: Stack, features: FeatureMap, gamma: float
) -> Float[np.ndarray, "R"]:
    """NPEC of the first column from each of the columns; NaN where either leaves nothing.

    Cost: one pass over the features and one F x F solve.
    """
    columns = np.asarray(rewards, dtype=np.float64)
    gram, cross, square = 0.0, 0.0, 0.0
    for part, now, ahead in in_parts(steps, np.arange(len(columns)), features):
        shapes = np.column_stack([np.ones(len(part)), gamma * ahead - now])
        gram = gram + shapes.T @ shapes
        cross = cross + shapes.T @ columns[part]
        square = square + columns[part].T @ columns[part]
    # what is left of each pair of columns once offset and potentials are regressed off
    left = square - np.asarray(cross).T @ np.linalg.lstsq(gram, cross, rcond=1e-12)[0]
    own = np.diag(left).copy()
    own[own <= 1e-10 * np.diag(square)] = np.nan
    rho = left[0] / np.sqrt(own[0] * own)
    return np.sqrt(1.0 - np.clip(rho, 0.0, 1.0) ** 2)
