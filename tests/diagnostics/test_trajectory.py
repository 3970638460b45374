import numpy as np
import pytest

from irl.core.rng import stream
from irl.diagnostics.trajectory import (
    agreement,
    classical_scaling,
    cycling,
    flips,
    pair_flips,
    trajectory,
)

ONES = np.ones(5)


def axes(n: int = 5) -> np.ndarray:
    """Columns at right angles, each of mean 0 and length 1."""
    x = stream(0, "axes").normal(size=(400, n))
    return np.linalg.qr(x - x.mean(0))[0]


def test_a_frozen_reward_does_not_move() -> None:
    r = axes(1)[:, 0]
    moved = trajectory(np.column_stack([r, 2 * r, r, 5 * r, r]), r, ONES)
    assert max(moved.speed) < 1e-7
    assert max(moved.to_final) < 1e-7
    assert np.isnan(moved.cycling)
    assert moved.flips == (0, 0, 0, 0)
    assert moved.agreement == pytest.approx([1] * 5)
    np.testing.assert_allclose(moved.matrix, 0, atol=1e-7)


def test_straight_on_has_index_one_and_round_and_round_a_large_one() -> None:
    a, b = axes(2).T

    def turned(*degrees: float) -> np.ndarray:
        return np.column_stack([np.cos(t) * a + np.sin(t) * b for t in np.radians(degrees)])

    straight = trajectory(turned(0, 1, 2, 3, 4), a, ONES)
    assert straight.cycling == pytest.approx(1, rel=1e-3)
    assert trajectory(turned(0, 90, 180, 270, 370), a, ONES).cycling > 10
    assert straight.to_final[-1] == 0
    assert list(straight.to_final) == sorted(straight.to_final, reverse=True)


def test_the_map_keeps_distances_that_fit_a_plane() -> None:
    places = stream(1, "map").normal(size=(6, 2))
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    made = classical_scaling(distances)
    np.testing.assert_allclose(np.linalg.norm(made[:, None] - made[None], axis=2), distances, atol=1e-9)


def test_a_snapshot_that_says_nothing_has_no_place() -> None:
    a, b = axes(2).T
    moved = trajectory(np.column_stack([1e-9 * a, a, b]), a, np.ones(3))
    assert np.isnan(moved.speed[0])
    assert moved.speed[1] == pytest.approx(np.sqrt(0.5))
    assert np.isnan(moved.map[0]).all()
    assert np.isfinite(moved.map[1:]).all()


def test_a_snapshot_in_between_that_says_nothing_leaves_no_length_of_the_way() -> None:
    a, b = axes(2).T
    moved = trajectory(np.column_stack([a, 1e-9 * a, b]), a, np.ones(3))
    assert np.isnan(moved.speed).all()
    assert moved.matrix[0, 2] == pytest.approx(np.sqrt(0.5))
    assert np.isnan(moved.cycling)


def test_signs_and_orders_are_counted() -> None:
    before, after = np.array([1.0, 2, -3, 4]), np.array([1.0, -2, -3, 4])
    assert flips(before, after) == 0.25
    assert agreement(after, before) == pytest.approx(8 / 10)
    assert np.isnan(agreement(after, np.zeros(4)))
    assert pair_flips(np.arange(4.0), np.array([1.0, 0, 2, 3])) == pytest.approx(1 / 6)
    assert np.isnan(cycling([0.1], float("nan")))
