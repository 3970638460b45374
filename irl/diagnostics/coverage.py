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
    """The share of new steps (s, a) that lie outside the probe; about 0.01 of steps like its own."""
    there, steps = _thinned(_seen(probe)), _thinned(_seen(new))
    mean, std = np.mean(there, axis=0), np.std(there, axis=0)
    std = np.where(std < MIN_STD, 1.0, std)
    there, steps = (there - mean) / std, (steps - mean) / std
    tree = KDTree(there)
    k = min(NEIGHBOURS, len(there) - 1)
    if k < 1:
        return float("nan")
    own = tree.query(there, k=[k + 1])[0][:, 0]
    return float(np.mean(tree.query(steps, k=[k])[0][:, 0] > np.quantile(own, INSIDE)))


def _seen(batch: Transitions) -> Float[np.ndarray, "B I"]:
    return np.concatenate([batch.obs.double().numpy(), batch.action.double().numpy()], axis=1)


def _thinned(rows: Float[np.ndarray, "B I"]) -> Float[np.ndarray, "C I"]:
    return rows[np.linspace(0, len(rows) - 1, min(MOST, len(rows))).astype(int)]
