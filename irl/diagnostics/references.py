"""Distances by the names they have elsewhere, for comparison: none of them is the default.

    pearson    D of the rewards of steps                         shaping counts in full
    spearman   D of their ranks                                  and a bent scale does not
    kendall    (1 - tau) / 2, the share of pairs in other order
    erc        D of discounted returns                           one number an episode
    starc-val  VAL at n = 1
    npec       the nearest reward that asks for the same
    epic       potentials averaged away over invented steps      needs a reward of (s, a, s')

Source: Gleave et al. (2021), arXiv:2006.13900, for ERC, NPEC and EPIC; for VAL Skalse et al. (2024),
arXiv:2309.15257.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from scipy.stats import rankdata

from irl.core import statistics
from irl.core.rng import stream
from irl.diagnostics import bootstrap, epic, npec, val
from irl.diagnostics.compare import SHAPINGS, Columns, compare, tests_of
from irl.diagnostics.distance import NAN, Distance, pearson_distance
from irl.diagnostics.features import fitted
from irl.diagnostics.segments import WHOLE, Segments, segments
from irl.diagnostics.stack import Given

NAMES = ("pearson", "spearman", "kendall", "erc", "starc-val", "npec", "epic")
KENDALL_STEPS, KENDALL_DRAWS = 2000, 100
"""Evenly spaced steps and resamples that Kendall's tau, which sorts, is taken over."""
EPIC_STEPS, EPIC_TEST_STEPS = 1024, 128
"""Steps, and invented pairs for each, that EPIC is taken over, and its self-tests."""


def of_steps(name: str, of: Columns, seed: int) -> list[Distance]:
    """One named distance, but for EPIC, of every reward asked about.

    Raises:
        ValueError: the name is not known, or EPIC's, which needs functions.
    """
    layout, every = of.steps.layout, Segments(of.usable, of.steps.layout.episode)
    match name:
        case "pearson":
            return compare(name, every, of, seed)
        case "spearman":
            ranks = np.apply_along_axis(rankdata, 0, of.usable)
            return compare(name, Segments(ranks, layout.episode), of, seed)
        case "kendall":
            return _kendall(every, of, seed)
        case "erc":
            return compare(name, segments(of.usable, layout, of.gamma, WHOLE), of, seed, unit="episodes")
        case "starc-val":
            return [replace(d, name=name) for d in val.distances(val.canonical(of, seed), 1, seed)]
        case "npec":
            features = fitted(of.steps.batch.obs.numpy(), stream(seed, "features"))
            left = npec.left_over(of.usable, of.steps, features, of.gamma)
            return compare(name, Segments(left, layout.episode), of, seed, distance=npec.of_correlation)
    raise ValueError(f"no distance of steps is called {name!r}; known: {', '.join(NAMES)}")


def of_functions(
    truth: Given, rewards: Sequence[Given], of: Columns, seed: int, size: int = EPIC_STEPS
) -> list[Distance]:
    """EPIC of rewards of (s, a, s'), over `size` steps drawn from the stack.

    The invented pairs are drawn from the same steps: actions from theirs, states from theirs.

    Cost: 3 size^2 rewards of each; the self-tests are taken over fewer.
    """
    batch, rng = of.steps.batch, stream(seed, "epic")
    rows, states, actions = (torch.from_numpy(rng.permutation(len(batch))[:size]) for _ in range(3))
    rows = rows.sort().values
    samples = replace(batch[states], action=batch.action[actions])

    def left(reward: Given, n: int) -> Float[np.ndarray, "B"]:
        return epic.canonical(reward, batch[rows[:: len(rows) // n]], samples[:n], of.gamma)

    few = min(EPIC_TEST_STEPS, len(rows))
    # C is linear: that of the shaped reference is the sum of two
    own, *random = [left(f, few) for f in (truth, *tests_of(of.raw[:, 0], of.steps, of.gamma, seed))]
    tested = [*(own + shaping for shaping in random[:SHAPINGS]), -own, random[SHAPINGS]]
    tests = [pearson_distance(own, values) for values in tested]
    values = np.column_stack([left(reward, len(rows)) for reward in (truth, *rewards)])
    return compare("epic", Segments(values, of.steps.layout.episode[rows.numpy()]), of, seed, tests=tests)


def _kendall(every: Segments, of: Columns, seed: int) -> list[Distance]:
    rows = np.linspace(0, len(every.values) - 1, min(KENDALL_STEPS, len(every.values))).astype(int)
    thin = Segments(every.values[rows], every.episode[rows])
    found = compare("kendall", thin, of, seed)
    drawn = bootstrap.counts(of.steps.layout, KENDALL_DRAWS, stream(seed, "bootstrap"))

    def share(a: Float[np.ndarray, "M"], b: Float[np.ndarray, "M"]) -> float:
        return (1.0 - statistics.kendall(a, b)) / 2.0

    def column(i: int) -> float:
        return share(thin.values[:, 0], thin.values[:, i])

    tests = [column(i) for i in range(1 + of.asked, thin.values.shape[1])]
    replaced = []
    for i, d in enumerate(found, 1):
        low, high = bootstrap.interval(bootstrap.statistic(share, thin, (0, i), drawn))
        known = d.reason is None
        replaced.append(
            replace(
                d,
                value=column(i) if known else NAN,
                low=low if np.isfinite(d.low) else NAN,
                high=high if np.isfinite(d.low) else NAN,
                self_error=max(tests[:SHAPINGS]),
                negation=tests[SHAPINGS],
                random=tests[SHAPINGS + 1],
            )
        )
    return replaced
