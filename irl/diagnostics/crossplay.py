"""Whether a reward ranks policies as the hand-written one does: snapshots of a reward by policies.

    M[t, j]   mean return of policy j under snapshot t        J[j]   under the hand-written reward
    regret    (max J - J[argmax_j M[t, j]]) / (max J - min J)

Regret is what trusting the reward costs: 0 where its favourite is the best policy, 1 where it is the worst.
Policies are the design; what is drawn again is the episodes of each, so an interval says how well these
policies were measured and not what others would show. Policies of one run alone agree with nearly any
reward: the set has to mix them with others.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import rankdata

from irl.core.statistics import ROUNDING
from irl.diagnostics.bootstrap import DRAWS, interval

Rows = Float[np.ndarray, "D P"]


@dataclass(frozen=True)
class Estimate:
    """A number and where 95 % of redrawn episodes put it; NaN where it is undefined."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Agreement:
    """How one snapshot's returns agree with the true ones, over policies."""

    pearson: Estimate
    spearman: Estimate
    kendall: Estimate
    """tau-b."""
    regret: Estimate


@dataclass(frozen=True, eq=False)
class CrossPlay:
    """S snapshots by P policies."""

    learned: Float[np.ndarray, "S P"]
    true: Float[np.ndarray, "P"]
    agreement: tuple[Agreement, ...]
    """A row a snapshot."""


def cross_play(
    returns: Sequence[Float[np.ndarray, "_ C"]], rng: np.random.Generator, draws: int = DRAWS
) -> CrossPlay:
    """The matrix of mean returns, and how each of its rows agrees with the true returns.

    Args:
        returns: of each policy a row an episode: its true return, then that under each snapshot.
        rng: draws the episodes again.
    Raises:
        ValueError: there are fewer than two policies, one has no episode, or a return is not finite.
    Cost: `draws` P^2 a snapshot.
    """
    if len(returns) < 2 or not all(len(rows) for rows in returns):
        raise ValueError(f"policies are compared by episodes, of these there are {[len(r) for r in returns]}")
    if not all(np.isfinite(rows).all() for rows in returns):
        raise ValueError("a return of these policies is not a finite number")
    means = np.stack([rows.mean(0) for rows in returns])
    drawn = np.stack([_means_again(rows, rng, draws) for rows in returns], axis=1)
    # one episode of a policy cannot be drawn otherwise: an interval would leave its chance out
    known = min(map(len, returns)) > 1
    true, again = means[:, 0], drawn[:, :, 0] if known else None
    rows = range(1, means.shape[1])
    of_each = tuple(_agreement(means[:, t], true, drawn[:, :, t], again) for t in rows)
    return CrossPlay(means[:, 1:].T, true, of_each)


def pearson(a: Rows, b: Rows) -> Float[np.ndarray, "D"]:
    """Linear correlation of each row of `a` with that of `b`; NaN where either is constant."""
    x, y = _centred(a), _centred(b)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.clip((x * y).sum(1) / np.sqrt((x**2).sum(1) * (y**2).sum(1)), -1.0, 1.0)


def spearman(a: Rows, b: Rows) -> Float[np.ndarray, "D"]:
    """Correlation of the ranks of each row; equal values share the average of their ranks."""
    return pearson(rankdata(a, axis=1), rankdata(b, axis=1))


def kendall(a: Rows, b: Rows) -> Float[np.ndarray, "D"]:
    """Kendall's tau-b of each row.

    tau_b = (pairs in one order - pairs in the other) / sqrt(pairs untied in a * pairs untied in b)
    """
    first, second = np.triu_indices(a.shape[1], 1)
    x, y = np.sign(a[:, first] - a[:, second]), np.sign(b[:, first] - b[:, second])
    with np.errstate(invalid="ignore", divide="ignore"):
        return (x * y).sum(1) / np.sqrt((x != 0).sum(1) * (y != 0).sum(1))


def regret(learned: Rows, true: Rows) -> Float[np.ndarray, "D"]:
    """What of the span of true returns the learned favourite misses; of equal favourites the mean."""
    favourite = learned == learned.max(1, keepdims=True)
    got = (true * favourite).sum(1) / favourite.sum(1)
    best, worst = true.max(1), true.min(1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return (best - got) / np.where(best > worst, best - worst, np.nan)


def _agreement(
    learned: Float[np.ndarray, "P"],
    true: Float[np.ndarray, "P"],
    learned_again: Rows,
    true_again: Rows | None,
) -> Agreement:
    def estimate(measure: Callable[[Rows, Rows], Float[np.ndarray, "D"]]) -> Estimate:
        value = float(measure(learned[None], true[None])[0])
        if true_again is None or not np.isfinite(value):
            return Estimate(value, float("nan"), float("nan"))
        return Estimate(value, *interval(measure(learned_again, true_again)))

    return Agreement(estimate(pearson), estimate(spearman), estimate(kendall), estimate(regret))


def _means_again(
    rows: Float[np.ndarray, "E C"], rng: np.random.Generator, draws: int
) -> Float[np.ndarray, "D C"]:
    """Means over as many episodes drawn with replacement, each time."""
    n = len(rows)
    return rng.multinomial(n, np.full(n, 1.0 / n), size=draws) @ rows / n


def _centred(rows: Rows) -> Rows:
    centred = rows - rows.mean(1, keepdims=True)
    constant = np.ptp(rows, axis=1) <= ROUNDING * np.abs(rows).max(1)
    return np.where(constant[:, None], 0.0, centred)
