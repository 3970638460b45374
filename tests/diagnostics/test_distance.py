import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from irl.core.rng import stream
from irl.diagnostics.distance import (
    Distance,
    of_correlation,
    pearson_distance,
    pearson_distances,
    why_undefined,
)

values = arrays(np.float64, (3, 7), elements=st.floats(-1e3, 1e3, width=32))


@given(values)
def test_it_is_the_formula_in_range_and_symmetric(rows) -> None:
    a, b = rows[:2]
    if np.std(a) < 1e-6 or np.std(b) < 1e-6:
        return
    found = pearson_distance(a, b)
    expected = np.sqrt((1 - np.corrcoef(a, b)[0, 1]) / 2)
    assert found == pytest.approx(expected, abs=1e-6)
    assert found == pytest.approx(pearson_distance(b, a), abs=1e-12)


def test_a_difference_of_a_billionth_keeps_its_digits() -> None:
    a, b = stream(0, "test").normal(size=(2, 4000))
    b = b - a * (a @ b) / (a @ a)
    near = pearson_distance(a - a.mean(), a + 1e-9 * b)
    assert near == pytest.approx(0.5e-9 * np.std(b) / np.std(a), rel=0.02)


def test_a_constant_or_a_hole_is_undefined_and_never_zero() -> None:
    a = np.arange(5.0)
    for other in (np.full(5, 0.1), np.array([1, np.nan, 2, 3, 4])):
        assert np.isnan(pearson_distance(a, other))
    assert np.isnan(of_correlation(float("nan")))
    assert np.isnan(pearson_distances(np.column_stack([a, np.ones(5)]))[0, 1])


def test_all_pairs_agree_with_one() -> None:
    columns = stream(1, "test").normal(size=(50, 3))
    every = pearson_distances(columns)
    assert every[0, 2] == pytest.approx(pearson_distance(columns[:, 0], columns[:, 2]), abs=1e-9)


def test_an_offset_does_not_count() -> None:
    a = stream(2, "test").normal(size=100)
    assert pearson_distance(a, a + 5) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    ("raw", "left", "reason"),
    [
        (np.zeros(4), np.zeros(4), "x is 0 on these steps"),
        (np.full(4, 2.0), np.zeros(4), "x is constant on these steps"),
        (np.arange(4.0), np.full(4, 1e-9), "x is nothing but shaping on these steps"),
        (np.array([1.0, np.inf]), np.zeros(2), "x is not finite on 1 of these 2 steps"),
        (np.arange(4.0), np.zeros(1), "a distance needs two steps or more, there are 1"),
        (np.arange(4.0), np.arange(4.0), None),
    ],
)
def test_the_reason_is_named(raw, left, reason) -> None:
    assert why_undefined("x", raw, left) == reason


def test_below_its_own_error_it_is_not_distinguishable() -> None:
    assert Distance("VAL", 0.02, self_error=0.03).shown == "not distinguishable"
    assert Distance("VAL", 0.04, self_error=0.03).shown == "0.040"
    assert Distance("VAL", float("nan"), self_error=0.03).shown == "undefined"
    assert Distance("VAL", 0.04).distinguishable is None
