"""The default distance: n-step VAL. A value function is taken off each reward, and segments are compared.

    VAL_n(R, R') = D(G_n(delta), G_n(delta')),   delta = r + gamma V(s') - V(s)      (values, segments)

Shaping and positive scale do not count, an offset only where episodes end early. n = 1 compares steps, as
STARC with VAL does; longer segments forgive what the features of V cannot express, because in a sum the
potentials cancel but for the first and the last. n = 50 is the headline; the curve over n is shown with it.

EPIC and DARD compare what is left of (x' - x) / dt once potentials are off, a hundredth of it at gamma = .99:
on MuJoCo they find running backwards next to running forwards.

Source: Skalse et al. (2024), arXiv:2309.15257 (VAL). The segments, the fitted V and the Pearson distance in
place of a norm are ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from irl.core.rng import stream
from irl.diagnostics import bootstrap, random_rewards
from irl.diagnostics.distance import (
    Distance,
    cosine_distance,
    pearson_distance,
    why_undefined,
)
from irl.diagnostics.features import fitted
from irl.diagnostics.segments import WHOLE, Segments, segments
from irl.diagnostics.stack import Stack
from irl.diagnostics.values import td_errors

CURVE = (1, 10, 50, 100, WHOLE)
HEADLINE = 50
SHAPINGS = 3
"""Random shapings that the self-test takes the worst of."""


@dataclass(frozen=True, eq=False)
class Canonical:
    """TD errors of R rewards, the reference first and after it those of the self-tests."""

    errors: Float[np.ndarray, "N R"]
    raw: Float[np.ndarray, "N R"]
    steps: Stack
    gamma: float
    rewards: int
    """How many of the columns, after the reference, are rewards that were asked about."""


def canonical(
    truth: Float[np.ndarray, "N"],
    rewards: Float[np.ndarray, "N R"],
    steps: Stack,
    gamma: float,
    seed: int,
) -> Canonical:
    """The rewards, the reference and its self-tests with their value functions off.

    Args:
        truth: the reference, a value a step of `steps`.
        rewards: those to be compared with it.
        seed: draws the features and the random rewards.
    Cost: that of `values.td_errors`, once for all.
    """
    rng = stream(seed, "self tests")
    std = float(np.std(truth))
    tests = [truth + random_rewards.shaping(steps.batch, gamma, std, rng) for _ in range(SHAPINGS)]
    tests += [-truth, random_rewards.noise(steps.batch, std, rng)]
    raw = np.column_stack([truth, rewards, *tests])
    features = fitted(steps.batch.obs.numpy(), stream(seed, "features"))
    # what is not finite would spread over all through the shared products
    usable = np.where(np.all(np.isfinite(raw), axis=0), raw, 0.0)
    errors = td_errors(usable, steps, features, gamma)
    return Canonical(errors, raw, steps, gamma, rewards.shape[1])


def distances(of: Canonical, n: int, seed: int, draws: int = bootstrap.DRAWS) -> list[Distance]:
    """VAL_n of each reward to the reference, with its interval and self-tests.

    Segments of `WHOLE` episodes compare returns less the value of their first state.
    """
    sums = segments(of.errors, of.steps.layout, of.gamma, n)
    reasons = _reasons(of, sums, n)
    drawn = bootstrap.counts(of.steps.layout, draws, stream(seed, "bootstrap"))
    rho = bootstrap.correlations(sums, 0, drawn)
    first_test = 1 + of.rewards
    tests = [pearson_distance(sums.values[:, 0], column) for column in sums.values[:, first_test:].T]
    found = []
    for i in range(1, first_test):
        reason = reasons[0] or reasons[i]
        low, high = bootstrap.interval(np.sqrt((1.0 - rho[:, i]) / 2.0))
        nan = float("nan")
        found.append(
            Distance(
                name="VAL",
                value=nan if reason else pearson_distance(sums.values[:, 0], sums.values[:, i]),
                low=nan if reason else low,
                high=nan if reason else high,
                self_error=nan if reasons[0] else max(tests[:SHAPINGS]),
                negation=tests[SHAPINGS],
                random=tests[SHAPINGS + 1],
                n=n,
                size=len(sums.values),
                episodes=len(np.unique(sums.episode)),
                reason=reason,
            )
        )
    return found


def curve(of: Canonical, ns: Sequence[int], seed: int) -> list[list[Distance]]:
    """`distances` at each n: a row an n, a column a reward."""
    return [distances(of, n, seed) for n in ns]


def uncentred(of: Canonical, n: int) -> list[float]:
    """The cosine distance of each reward to the reference: an offset counts where episodes end early."""
    values = segments(of.errors, of.steps.layout, of.gamma, n).values
    return [cosine_distance(values[:, 0], values[:, i]) for i in range(1, 1 + of.rewards)]


def _reasons(of: Canonical, sums: Segments, n: int) -> list[str | None]:
    held, every = len(np.unique(sums.episode)), len(of.steps.layout.length)
    if 2 * held < every:
        # those that ended early would be all that is left of the others
        return [f"segments of {n} steps fit into {held} of {every} episodes"] * (1 + of.rewards)
    names = ["the hand-written reward"] + ["the learned reward"] * of.rewards
    return [
        why_undefined(name, of.raw[:, i], sums.values[:, i], "segments") for i, name in enumerate(names)
    ]
