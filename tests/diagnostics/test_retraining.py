"""A ratio of returns whose parts are known."""

import math

import numpy as np
import pytest

from irl.core.statistics import iqm
from irl.diagnostics.retraining import retrain_ratio


def test_the_ratio_is_of_what_lies_above_random() -> None:
    rng = np.random.default_rng(0)
    fresh = [np.full(5, value) for value in (40.0, 60.0, 80.0)]
    found = retrain_ratio(fresh, np.full(5, 110.0), 10.0, rng)
    assert found.value == pytest.approx(0.5)
    # of three seeds drawn again, all may be the lowest or the highest
    assert (found.low, found.high) == (pytest.approx(0.3, abs=0.07), pytest.approx(0.7, abs=0.07))
    # negative returns: a ratio of the returns themselves would be above 1 for the worse
    assert retrain_ratio([np.array([-50.0])], np.array([-25.0, -25.0]), -125.0, rng).value == 0.75


def test_one_seed_has_no_interval_and_one_that_fails_is_trimmed() -> None:
    rng = np.random.default_rng(0)
    assert math.isnan(retrain_ratio([np.ones(3)], np.full(3, 2.0), 0.0, rng).low)
    assert iqm(np.array([0.0, 1.0, 1.0, 1.0, 1.0, -1000.0, 1.0, 1000.0])) == 1.0


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    held = 0
    for seed in range(16):
        rng = np.random.default_rng(seed)
        fresh = [50.0 + 10 * rng.normal() + 5 * rng.normal(size=20) for _ in range(6)]
        found = retrain_ratio(fresh, 100.0 + 5 * rng.normal(size=20), 0.0, rng, draws=100)
        held += found.low <= 0.5 <= found.high
    # six seeds are few, and their bootstrap is short of its 95 %
    assert held >= 12


@pytest.mark.parametrize(
    ("fresh", "beside", "random"),
    [([], [1.0], 0.0), ([[1.0]], [np.nan], 0.0), ([[1.0]], [0.0, 0.0], 0.0), ([[1.0]], [5.0, -5.0], -1.0)],
)
def test_a_ratio_to_nothing_is_refused(fresh: list, beside: list, random: float) -> None:
    with pytest.raises(ValueError, match="return"):
        retrain_ratio([np.array(r) for r in fresh], np.array(beside), random, np.random.default_rng(0))
