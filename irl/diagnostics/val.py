"""The default distance: n-step VAL. A value function is taken off each reward, and segments are compared.

    VAL_n(R, R') = D(G_n(delta), G_n(delta')),   delta = r + gamma V(s') - V(s)      (values, segments)

Shaping and positive scale do not count, an offset only where episodes end early. n = 1 compares steps, as
STARC with VAL does; longer segments forgive what the features of V cannot express, because in a sum the
potentials cancel but for the first and the last. n = 50 is the headline; the curve over n is shown with it.

MuJoCo's forward reward (x' - x) / dt is a difference of potentials itself. With x in the state DARD keeps a
hundredth of it at gamma = .99 and finds running backwards next to running forwards; here x is no feature.

Source: Skalse et al. (2024), arXiv:2309.15257 (VAL). The segments, the fitted V and the Pearson distance in
place of a norm are ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from irl.core.rng import stream
from irl.diagnostics.compare import Columns, compare
from irl.diagnostics.distance import Distance
from irl.diagnostics.features import fitted
from irl.diagnostics.segments import WHOLE, segments
from irl.diagnostics.stack import Layout
from irl.diagnostics.values import td_errors

CURVE = (1, 10, 50, 100, WHOLE)
HEADLINE = 50


@dataclass(frozen=True, eq=False)
class Canonical:
    """Columns of rewards, and what is left of them once their value functions are off."""

    columns: Columns
    errors: Float[np.ndarray, "N R"]


def canonical(of: Columns, seed: int) -> Canonical:
    """The TD errors of every column; `seed` draws the features.

    Cost: that of `values.td_errors`, once for all.
    """
    batch = of.steps.batch
    features = fitted(batch.obs.numpy(), stream(seed, "features"))
    return Canonical(of, td_errors(of.usable, of.steps, features, of.gamma))


def distances(of: Canonical, n: int, seed: int) -> list[Distance]:
    """VAL_n of each reward to the reference, with its interval and self-tests.

    Segments of `WHOLE` episodes compare returns less the value of their first state.
    """
    c = of.columns
    return compare("VAL", segments(of.errors, c.steps.layout, c.gamma, n), c, seed, n, "segments")


def longest(layout: Layout, ns: Sequence[int] = CURVE) -> int:
    """The longest of `ns` up to 50 that at least half of the episodes have room for; 1 where none is."""
    fits = [n for n in ns if 0 < n <= HEADLINE and _room(layout, n) >= 0.5]
    return max(fits, default=1)


def _room(layout: Layout, n: int) -> float:
    return float(np.mean(layout.terminated | (layout.length >= n)))
