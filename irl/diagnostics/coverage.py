"""Whether new steps lie where a probe has some: elsewhere what was measured on it says nothing.

    distance of a step    to its k-th nearest probe step, in standard deviations of the probe
    outside               farther than 99 % of the probe's own steps are from each other

The distances among its own steps leave each step itself out.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from irl.core.nets import MIN_STD
from irl.core.types import Transitions

NEIGHBOURS = 5
MOST = 1000
"""Steps of a side, evenly spaced: in so many dimensions nearest neighbours cost the product."""
INSIDE = 0.99


@dataclass(frozen=True, eq=False)
class Coverage:
    """Where a probe has steps (s, a)."""

    mean: Float[np.ndarray, "I"]
    std: Float[np.ndarray, "I"]
    tree: KDTree
    radius: float
    """Of 99 % of its own steps, the k-th neighbour is nearer; NaN where there are too few to have any."""

    def outside(self, new: Transitions) -> float:
        """The share of new steps that lie outside; about 0.01 of steps like the probe's own."""
        if not np.isfinite(self.radius):
            return float("nan")
        steps = (_thinned(_seen(new)) - self.mean) / self.std
        distances, _ = self.tree.query(steps, k=NEIGHBOURS)
        return float(np.mean(distances[:, -1] > self.radius))


def coverage(probe: Transitions) -> Coverage:
    """Where the steps of `probe` lie."""
    there = _thinned(_seen(probe))
    mean, std = np.mean(there, axis=0), np.std(there, axis=0)
    std = np.where(std < MIN_STD, 1.0, std)
    there = (there - mean) / std
    tree, radius = KDTree(there), float("nan")
    if len(there) > NEIGHBOURS:
        own, _ = tree.query(there, k=NEIGHBOURS + 1)
        radius = float(np.quantile(own[:, -1], INSIDE))
    return Coverage(mean, std, tree, radius)


def _seen(batch: Transitions) -> Float[np.ndarray, "B I"]:
    return np.concatenate([batch.obs.double().numpy(), batch.action.double().numpy()], axis=1)


def _thinned(rows: Float[np.ndarray, "B I"]) -> Float[np.ndarray, "C I"]:
    return rows[np.linspace(0, len(rows) - 1, min(MOST, len(rows))).astype(int)]
