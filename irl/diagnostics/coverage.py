"""Whether new steps lie where a probe has some: elsewhere what was measured on it says nothing.

    distance of a step    to its k-th nearest probe step, in standard deviations of the probe
    outside               farther than 99 % of the probe's own steps are from each other

The distances among its own steps leave each step itself out.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from irl.core.nets import MIN_STD
from irl.core.types import Transitions

NEIGHBOURS = 5
MOST = 2000
"""Steps of a side, evenly spaced: nearest neighbours cost the product."""
INSIDE = 0.99


def outside(probe: Transitions, new: Transitions) -> float:
    """The share of new steps (s, a) that lie outside the probe; about 0.01 of steps like its own.

    NaN where the probe has too few to have neighbours.
    """
    there, steps = _thinned(_seen(probe)), _thinned(_seen(new))
    mean, std = np.mean(there, axis=0), np.std(there, axis=0)
    std = np.where(std < MIN_STD, 1.0, std)
    there, steps = (there - mean) / std, (steps - mean) / std
    if len(there) <= NEIGHBOURS:
        return float("nan")
    tree = KDTree(there)
    own, _ = tree.query(there, k=NEIGHBOURS + 1)
    new_ones, _ = tree.query(steps, k=NEIGHBOURS)
    return float(np.mean(new_ones[:, -1] > np.quantile(own[:, -1], INSIDE)))


def _seen(batch: Transitions) -> Float[np.ndarray, "B I"]:
    return np.concatenate([batch.obs.double().numpy(), batch.action.double().numpy()], axis=1)


def _thinned(rows: Float[np.ndarray, "B I"]) -> Float[np.ndarray, "C I"]:
    return rows[np.linspace(0, len(rows) - 1, min(MOST, len(rows))).astype(int)]
