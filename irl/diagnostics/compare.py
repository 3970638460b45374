"""From columns of numbers to distances: the reference first, the rewards asked about, then the self-tests.

What a distance is taken over (TD errors of segments, returns, ranks of steps) is its own business; the
correlation, the interval over episodes and the reading of the self-tests are the same for all.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from irl.core.rng import stream
from irl.diagnostics import bootstrap
from irl.diagnostics.distance import NAN, Distance, of_correlation, pearson_distance, why_undefined
from irl.diagnostics.random_rewards import noise, shaping
from irl.diagnostics.segments import Segments
from irl.diagnostics.stack import Given, Stack, read

SHAPINGS = 3
"""Random shapings that the invariance test takes the worst of."""
TRUTH, LEARNED = "the hand-written reward", "the learned reward"


@dataclass(frozen=True, eq=False)
class Columns:
    """Rewards of N steps side by side."""

    raw: Float[np.ndarray, "N R"]
    """The reference; the rewards asked about; the reference shaped, thrice; its negation; a random one."""
    steps: Stack
    gamma: float
    asked: int

    @property
    def usable(self) -> Float[np.ndarray, "N R"]:
        """`raw` with 0 for a reward that is not finite, which would spread over all through a product."""
        return np.where(np.all(np.isfinite(self.raw), axis=0), self.raw, 0.0)


def columns(
    truth: Float[np.ndarray, "N"],
    rewards: Float[np.ndarray, "N R"],
    steps: Stack,
    gamma: float,
    seed: int,
) -> Columns:
    """The rewards with the self-tests of `truth` beside them, which `seed` draws."""
    random = tests_of(truth, steps, gamma, seed)
    drawn = [read(reward, steps.batch) for reward in random]
    shaped = [truth + values for values in drawn[:SHAPINGS]]
    raw = np.column_stack([truth, rewards, *shaped, -truth, drawn[SHAPINGS]])
    return Columns(raw, steps, gamma, rewards.shape[1])


def tests_of(truth: Float[np.ndarray, "N"], steps: Stack, gamma: float, seed: int) -> list[Given]:
    """Random shapings as large as `truth`, and a random reward."""
    rng, std = stream(seed, "self tests"), float(np.std(truth)) if np.all(np.isfinite(truth)) else 1.0
    random = [shaping(steps.batch, gamma, std, rng) for _ in range(SHAPINGS)]
    return [*random, noise(steps.batch, std, rng)]


def compare(
    name: str,
    sums: Segments,
    of: Columns,
    seed: int,
    n: int | None = None,
    unit: str = "steps",
    distance: Callable[[float], float] = of_correlation,
    tests: Sequence[float] | None = None,
) -> list[Distance]:
    """The distance of each reward asked about to the reference.

    Args:
        sums: what is correlated, a column for each of `of`'s.
        distance: of a correlation. Near 0 the Pearson distance is computed without it, or digits were lost.
        tests: the self-tests where they were taken elsewhere; else the last columns are theirs.
    """
    reasons = _reasons(sums, of, n, unit)
    drawn = bootstrap.counts(of.steps.layout, bootstrap.DRAWS, stream(seed, "bootstrap"))
    rho = bootstrap.correlations(sums, 0, drawn)

    def measured(i: int) -> float:
        x, y = sums.values[:, 0], sums.values[:, i]
        near = pearson_distance(x, y)
        return near if distance is of_correlation else distance(1.0 - 2.0 * near**2)

    if tests is None:
        tests = [NAN if reasons[0] else measured(i) for i in range(1 + of.asked, of.raw.shape[1])]
    fewest = np.min(np.bincount(of.steps.layout.stratum))
    found = []
    for i in range(1, 1 + of.asked):
        reason = reasons[0] or reasons[i]
        # one episode of a kind cannot be drawn otherwise: an interval would leave its chance out
        low, high = NAN, NAN
        if fewest > 1 and reason is None:
            low, high = bootstrap.interval(np.array([distance(value) for value in rho[:, i]]))
        found.append(
            Distance(
                name=name,
                value=NAN if reason else measured(i),
                low=low,
                high=high,
                self_error=max(tests[:SHAPINGS]),
                negation=tests[SHAPINGS],
                random=tests[SHAPINGS + 1],
                n=n,
                size=len(sums.values),
                episodes=len(np.unique(sums.episode)),
                reason=reason,
            )
        )
    return found


def _reasons(sums: Segments, of: Columns, n: int | None, unit: str) -> Sequence[str | None]:
    held, every = len(np.unique(sums.episode)), len(of.steps.layout.length)
    if n is not None and 2 * held < every:
        # those that ended early would be all that is left of the others
        return [f"segments of {n} steps fit into {held} of {every} episodes"] * (1 + of.asked)
    return [
        why_undefined(LEARNED if i else TRUTH, of.raw[:, i], sums.values[:, i], unit)
        for i in range(1 + of.asked)
    ]
