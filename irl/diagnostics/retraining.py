"""What a reward is worth to a learner that starts from nothing: fresh policies against the one beside it.

    ratio = (IQM over seeds of J(fresh | r_t) - J_random) / (J(policy at t) - J_random)

J is the true return, the mean over a policy's episodes; IQM the mean of the middle half of the seeds, which
of three is the mean of all. The policy at t learned while the reward did and saw rewards that are gone: a
ratio well below 1 says that the frozen one does not carry what it learned. Under other dynamics the policy at
t is played there as it is, so the ratio is that of taking the reward along to that of taking the policy.

For the interval seeds are drawn again, and the episodes of each and of the policy at t within.

Source of IQM and of drawing by strata: Agarwal et al. (2021), arXiv:2108.13264.
"""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from irl.core.statistics import iqm
from irl.diagnostics.bootstrap import DRAWS, interval
from irl.diagnostics.crossplay import Estimate

Returns = Float[np.ndarray, "_"]


def retrain_ratio(
    fresh: Sequence[Returns], beside: Returns, random: float, rng: np.random.Generator, draws: int = DRAWS
) -> Estimate:
    """The ratio, with an interval where there are two seeds or more.

    Args:
        fresh: of each seed the returns of its episodes.
        beside: returns of the policy that learned beside the reward.
        random: mean return of random actions.
    Raises:
        ValueError: a return is not finite, or that policy is not above random actions by two of its standard
            errors: a ratio to it says nothing.
    """
    if not fresh or not len(beside) or not np.isfinite([*np.concatenate([*fresh, beside]), random]).all():
        raise ValueError("a return is missing, or not a finite number")
    span = float(beside.mean()) - random
    error = float(beside.std()) / math.sqrt(len(beside))
    if span <= 2.0 * error or span <= 1e-9 * abs(random):
        raise ValueError(
            f"the policy at that step returns {beside.mean():.4g}, random actions {random:.4g}: there is "
            f"nothing to be a ratio to"
        )
    value = (iqm(np.array([r.mean() for r in fresh])) - random) / span
    if len(fresh) < 2:
        return Estimate(value, math.nan, math.nan)
    again = np.empty(draws)
    for i in range(draws):
        seeds = rng.integers(len(fresh), size=len(fresh))
        means = np.array([_again(fresh[s], rng) for s in seeds])
        again[i] = (iqm(means) - random) / (_again(beside, rng) - random)
    return Estimate(value, *interval(again))


def _again(returns: Returns, rng: np.random.Generator) -> float:
    return float(returns[rng.integers(len(returns), size=len(returns))].mean())
