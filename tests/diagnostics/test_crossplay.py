"""Rewards by policies: brute force, planted rankings, and intervals that hold what they should."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irl.core import statistics
from irl.diagnostics.crossplay import CrossPlay, cross_play, kendall, pearson, regret, spearman

FEW = st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=2, max_size=9)


def tau_b(a: np.ndarray, b: np.ndarray) -> float:
    """Pair by pair."""
    balance = untied_a = untied_b = 0
    for i, j in itertools.combinations(range(len(a)), 2):
        x, y = int(np.sign(a[i] - a[j])), int(np.sign(b[i] - b[j]))
        balance, untied_a, untied_b = balance + x * y, untied_a + abs(x), untied_b + abs(y)
    return balance / math.sqrt(untied_a * untied_b) if untied_a and untied_b else math.nan


def missed(learned: np.ndarray, true: np.ndarray) -> float:
    """Policy by policy."""
    top = max(learned)
    got = [t for m, t in zip(learned, true, strict=True) if m == top]
    span = max(true) - min(true)
    return (max(true) - sum(got) / len(got)) / span if span else math.nan


@settings(max_examples=60, deadline=None)
@given(FEW)
def test_rank_measures_are_those_of_brute_force(pairs: list[tuple[int, int]]) -> None:
    a, b = np.array(pairs, dtype=float).T
    for fast, slow in (
        (kendall, tau_b),
        (regret, missed),
        (pearson, statistics.pearson),
        (spearman, statistics.spearman),
    ):
        np.testing.assert_allclose(fast(a[None], b[None])[0], slow(a, b), atol=1e-12, equal_nan=True)


def played(scales: list[float], n: int = 6, noise: float = 3.0, seed: int = 0) -> CrossPlay:
    """Eight policies of true means 0, 10, ..., and a snapshot that pays `scale` times it, with noise."""
    rng = np.random.default_rng(seed)
    returns = []
    for true in range(0, 80, 10):
        own = true + noise * rng.normal(size=(n, 1))
        snapshots = [scale * own + 5.0 + (scale == 0) * rng.normal(size=(n, 1)) for scale in scales]
        returns.append(np.hstack([own, *snapshots]))
    return cross_play(returns, np.random.default_rng(1), draws=300)


def test_a_scaled_truth_agrees_its_negation_is_the_worst_and_noise_is_in_between() -> None:
    found = played([0.2, -0.2, 0.0])
    same, opposite, noise = found.agreement
    for measure in (same.pearson, same.spearman, same.kendall):
        assert measure.value == pytest.approx(1.0)
    assert (same.regret.value, opposite.regret.value) == (0.0, 1.0)
    assert opposite.kendall.value == pytest.approx(-1.0)
    assert abs(noise.kendall.value) < 0.9
    assert noise.kendall.high - noise.kendall.low > 0.3
    assert found.learned.shape == (3, 8)
    np.testing.assert_allclose(found.learned[0], 0.2 * found.true + 5.0)


def test_the_interval_holds_the_rank_correlation_of_the_true_means() -> None:
    # neighbours 10 apart, measured to within 15: now and then two change places
    held, widths = 0, []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        returns = [
            np.column_stack([t + 15 * rng.normal(size=10), t + 15 * rng.normal(size=10)])
            for t in range(0, 80, 10)
        ]
        one = cross_play(returns, rng, draws=300).agreement[0].kendall
        held += one.low <= 1.0 <= one.high
        widths.append(one.high - one.low)
    assert held >= 17
    assert np.mean(widths) < 0.5


def test_one_episode_of_a_policy_gives_no_interval_and_a_constant_no_correlation() -> None:
    one = played([1.0], n=1).agreement[0]
    assert one.kendall.value == pytest.approx(1.0)
    assert math.isnan(one.kendall.low)
    flat = cross_play([np.array([[1.0, 2.0]] * 3), np.array([[5.0, 2.0]] * 3)], np.random.default_rng(0))
    assert math.isnan(flat.agreement[0].kendall.value)
    assert flat.agreement[0].regret.value == pytest.approx(0.5)


def test_the_same_generator_draws_the_same_and_what_cannot_be_compared_is_said() -> None:
    assert played([0.3]).agreement == played([0.3]).agreement
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="by episodes"):
        cross_play([np.ones((2, 2))], rng)
    with pytest.raises(ValueError, match="not a finite number"):
        cross_play([np.ones((2, 2)), np.full((2, 2), np.nan)], rng)
