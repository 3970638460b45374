"""Which snapshot of a reward to keep, without the true reward.

    loss        of the discriminator on held-out demonstrations against the steps of every policy of the run
    unstable    mean distance to the snapshots before and after          (VAL, trajectory)
    disagrees   1 - mean Kendall tau-b between its ranking of the policies and those of its neighbours

Each criterion ranks the snapshots, lowest best; the mean of the ranks chooses, the later of equals. A
discriminator at the end of a run that went well cannot tell its own policy from the expert, but a good reward
still tells the expert from all that the policy was before: so the loss is against all of them.

The untrained reward of step 0 is not among those that are chosen from.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import rankdata

from irl.diagnostics import crossplay

RULE = "lowest mean rank of held-out loss, distance to neighbours and disagreement with neighbours"


@dataclass(frozen=True)
class Criteria:
    """Of one snapshot; NaN where it is not known. Lower is better in all."""

    loss: float
    unstable: float
    disagrees: float


@dataclass(frozen=True, eq=False)
class Choice:
    """The snapshot that is chosen, and why."""

    step: int
    criteria: Mapping[int, Criteria]
    ranks: Mapping[int, float]
    """Mean rank, 1 the best; NaN of what is not chosen from."""


def choose(criteria: Mapping[int, Criteria]) -> Choice:
    """The choice among snapshots after step 0; a criterion that is not known of all of them is left out.

    Raises:
        ValueError: there is no snapshot after step 0, or no criterion is known.
    """
    steps = [step for step in criteria if step > 0]
    if not steps:
        raise ValueError("there is no snapshot after step 0")
    table = np.array([[criteria[s].loss, criteria[s].unstable, criteria[s].disagrees] for s in steps])
    known = np.isfinite(table).all(axis=0)
    if not known.any():
        raise ValueError("no criterion is known of every snapshot")
    mean = rankdata(table[:, known], axis=0).mean(1)
    # of equals the later: it has seen more
    best = int(np.flatnonzero(mean == mean.min())[-1])
    ranks = dict.fromkeys(criteria, float("nan")) | dict(zip(steps, mean.tolist(), strict=True))
    return Choice(steps[best], dict(criteria), ranks)


def beside(between: Float[np.ndarray, "M"]) -> Float[np.ndarray, "S"]:
    """Of S = M + 1 snapshots in a row, the mean over the one or two neighbours.

    >>> beside(np.array([1.0, 3.0])).tolist()
    [1.0, 2.0, 3.0]
    """
    sums, count = np.zeros(len(between) + 1), np.zeros(len(between) + 1)
    for part in (slice(None, -1), slice(1, None)):
        sums[part] += between
        count[part] += 1
    return sums / np.maximum(count, 1)


def disagreement(learned: Float[np.ndarray, "S P"]) -> Float[np.ndarray, "S"]:
    """1 - tau-b between each snapshot's ranking of the policies and its neighbours', in [0, 2]."""
    return 1.0 - beside(crossplay.kendall(learned[:-1], learned[1:]))
