import numpy as np
import pytest

from irl.core.rng import stream
from irl.diagnostics.distribution import psi, shift
from irl.diagnostics.hygiene import hygiene


def test_an_offset_moves_values_by_itself_and_leaves_the_shape() -> None:
    r = stream(0, "r").normal(2, 3, 4000)
    moved = shift(r, r + 6)
    assert moved.w1 == pytest.approx(6 / np.std(r))
    assert moved.w1_aligned == pytest.approx(0, abs=1e-12)
    assert shift(r, 5 * r).w1_aligned == pytest.approx(0, abs=1e-12)
    assert moved.ks > 0.5
    assert moved.psi > 0.25


def test_what_stood_still_has_no_shift() -> None:
    r = stream(1, "r").normal(size=500)
    still = shift(r, r)
    assert (still.w1, still.ks, still.psi, still.w1_aligned) == (0, 0, 0, 0)


def test_ks_and_psi_are_what_they_are_called() -> None:
    before, after = np.arange(10.0), np.arange(10.0) + 5
    assert shift(before, after).ks == pytest.approx(0.5)
    # ten bins of a tenth before; after, five are empty and the last holds six tenths
    q = np.maximum(np.array([0, 0, 0, 0, 0, 0.1, 0.1, 0.1, 0.1, 0.6]), 1e-4)
    assert psi(before, after) == pytest.approx(np.sum((q - 0.1) * np.log(q / 0.1)), rel=1e-9)


def test_a_constant_or_a_hole_is_undefined() -> None:
    r = stream(2, "r").normal(size=50)
    assert np.isnan(shift(np.ones(50), r).w1)
    assert np.isnan(shift(np.ones(50), r).psi)
    assert np.isfinite(shift(r, np.ones(50)).w1)
    assert np.isnan(shift(r, np.ones(50)).w1_aligned)
    assert np.isnan(shift(np.append(r, np.nan), r).ks)
    assert np.isnan(shift(np.zeros(0), r).ks)


def test_the_survival_bias_says_what_living_pays() -> None:
    r, ends = stream(3, "r").normal(size=1000), np.arange(1000) % 10 == 9
    never = np.zeros(1000, dtype=bool)
    assert hygiene(np.full(1000, 3.0), never).survival_bias == 1
    assert hygiene(np.full(1000, -0.1), never).survival_bias == -1
    assert hygiene(np.zeros(1000), never).survival_bias == 0
    assert abs(hygiene(r, never).survival_bias) < 0.1
    found = hygiene(r - 5.0 * ends, ends)
    assert found.terminal_mean == pytest.approx(np.mean(r[ends]) - 5)
    assert found.other_mean == pytest.approx(np.mean(r[~ends]))
    assert np.isnan(hygiene(r, never).terminal_mean)
    assert found.positive == pytest.approx(np.mean(r - 5.0 * ends > 0))


def test_a_reward_that_is_not_finite_has_no_scale() -> None:
    assert np.isnan(hygiene(np.array([1.0, np.inf]), np.zeros(2, dtype=bool)).std)
