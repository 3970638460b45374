import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import trim_mean

from irl.core.rng import stream
from irl.core.statistics import auroc, iqm, iqm_interval, is_constant, kendall, pearson, spearman

small = st.integers(-3, 3).map(float)


def test_pearson_of_a_line_is_one_and_of_its_mirror_minus_one() -> None:
    x = np.linspace(-3.0, 5.0, 40)
    assert pearson(x, 2 * x + 7) == pytest.approx(1.0, abs=1e-15)
    assert pearson(x, -2 * x + 7) == pytest.approx(-1.0, abs=1e-15)


def test_kendall_counts_pairs() -> None:
    a, b = stream(0, "test").normal(size=(2, 40))
    signs = [np.sign((a[i] - a[j]) * (b[i] - b[j])) for i, j in itertools.combinations(range(40), 2)]
    assert kendall(a, b) == pytest.approx(np.mean(signs))
    assert kendall(a, -a) == pytest.approx(-1)


def test_pearson_agrees_with_numpy() -> None:
    a, b = stream(0, "test").normal(size=(2, 300))
    assert pearson(a, a + b) == pytest.approx(float(np.corrcoef(a, a + b)[0, 1]), abs=1e-14)


@pytest.mark.parametrize("measure", [pearson, spearman, kendall])
@pytest.mark.parametrize(
    "column",
    [
        np.full(5, 0.1),
        np.array([0.3, 0.1 + 0.2, 0.3, 0.3, 0.3]),
        np.array([1.0, 2.0, np.nan, 3.0, 4.0]),
        np.array([1.0, 2.0, np.inf, 3.0, 4.0]),
        np.zeros(5),
    ],
)
def test_a_correlation_with_a_constant_or_a_hole_is_undefined(measure, column) -> None:
    assert np.isnan(measure(column, np.arange(5.0)))
    assert np.isnan(measure(np.arange(5.0), column))


@pytest.mark.parametrize("n", [0, 1])
def test_a_correlation_of_fewer_than_two_is_undefined(n: int) -> None:
    assert np.isnan(pearson(np.ones(n), np.ones(n)))
    assert np.isnan(spearman(np.ones(n), np.ones(n)))


def test_extreme_magnitudes_neither_overflow_nor_vanish() -> None:
    a, b = stream(1, "test").normal(size=(2, 50))
    for factor in (1e300, 1e-300):
        assert pearson(factor * a, b) == pytest.approx(pearson(a, b), rel=1e-12)


def test_spearman_ignores_a_monotone_change_and_averages_ties() -> None:
    a = np.array([1.0, 2.0, 2.0, 3.0])
    # ranks 1, 2.5, 2.5, 4 against 1, 2, 3, 4: 4.5 / sqrt(4.5 * 5)
    assert spearman(a, np.arange(4.0)) == pytest.approx(np.sqrt(0.9), abs=1e-12)
    x = np.linspace(0.1, 4.0, 20)
    assert spearman(x, np.exp(x)) == pytest.approx(1.0)


@given(arrays(np.float64, st.integers(1, 12), elements=small), arrays(np.float64, 7, elements=small))
def test_auroc_is_the_share_of_won_pairs_with_ties_half(positive, negative) -> None:
    won = np.mean((positive[:, None] > negative) + 0.5 * (positive[:, None] == negative))
    assert auroc(positive, negative) == pytest.approx(float(won), abs=1e-12)
    assert auroc(negative, positive) == pytest.approx(1 - float(won), abs=1e-12)


def test_auroc_without_one_of_the_groups_is_undefined() -> None:
    assert np.isnan(auroc(np.zeros(0), np.ones(3)))
    assert np.isnan(auroc(np.ones(3), np.zeros(0)))
    assert np.isnan(auroc(np.array([1.0, np.nan]), np.ones(3)))


def test_constant_means_up_to_the_rounding_of_a_sum() -> None:
    assert is_constant(np.array([0.3, 0.1 + 0.2]))
    assert not is_constant(np.array([1.0, 1.0 + 1e-9]))


def test_the_interquartile_mean_cuts_whole_values_off_both_ends() -> None:
    assert iqm(np.array([9.0, 1.0, 2.0, -50.0])) == 1.5
    assert iqm(np.array([9.0, 1.0, 0.0, 2.0])) == 1.5
    assert iqm(np.array([3.0, 4.0, 5.0])) == 4.0
    assert iqm(np.array([1.0])) == 1.0
    assert iqm(np.array([0.0, 4.0])) == 2.0
    assert iqm(np.arange(8.0)) == trim_mean(np.arange(8.0), 0.25)
    assert math.isnan(iqm(np.array([])))
    assert math.isnan(iqm(np.array([1.0, np.inf])))


def test_its_interval_lies_around_it_and_one_value_has_none() -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(size=200)
    low, high = iqm_interval(values, rng)
    # the interquartile mean of a normal has a standard error of about 1.09 / sqrt(n)
    assert high - low == pytest.approx(2 * 1.96 * 1.09 / np.sqrt(200), rel=0.25)
    assert low < iqm(values) < high
    assert all(math.isnan(end) for end in iqm_interval(np.array([1.0]), rng))
    assert iqm_interval(np.array([2.0, 2.0]), rng) == (2.0, 2.0)
    low, high = iqm_interval(np.array([0.2, 0.4, 0.6, 0.8, 1.0]), rng)
    assert 0.2 <= low < 0.6 < high <= 1.0
