"""Closed forms, properties, and a slow bootstrap that is written as one reads it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irl.bench.statistics import averages, improvement, middle, steps_to
from irl.core.rng import stream
from irl.core.statistics import iqm

SCORES = st.lists(st.lists(st.floats(-1, 2), min_size=2, max_size=5), min_size=1, max_size=3)


def groups(scores: list[list[float]]) -> list[np.ndarray]:
    return [np.array(group) for group in scores]


def slow(of: list[np.ndarray], average, draws: int) -> tuple[float, float]:
    """One resample after the other, one task after the other."""
    rng, values = np.random.default_rng(1), []
    for _ in range(draws):
        drawn = []
        for group in of:
            drawn += [group[rng.integers(len(group))] for _ in group]
        values.append(average(np.array(drawn)))
    low, high = np.quantile(values, [0.025, 0.975])
    return float(low), float(high)


def test_intervals_are_those_of_the_bootstrap_as_one_reads_it() -> None:
    of = groups([[0.1, 0.5, 0.9, 0.95], [0.3, 0.35, 0.8], [1.0, 0.97]])
    middle_, mean = averages(of, stream(0, "t"))
    for found, average in ((middle_, iqm), (mean, np.mean)):
        low, high = slow(of, average, 6000)
        assert (found.low, found.high) == (pytest.approx(low, abs=0.02), pytest.approx(high, abs=0.02))
        assert found.value == pytest.approx(average(np.concatenate(of)))


def test_resamples_stay_within_their_task() -> None:
    # within each task nothing varies, so nothing is uncertain, though the tasks differ
    middle_, mean = averages(groups([[0.0, 0.0], [1.0, 1.0]]), stream(0, "t"))
    assert (mean.low, mean.value, mean.high) == (0.5, 0.5, 0.5)
    assert (middle_.low, middle_.high) == (0.5, 0.5)


def test_the_same_stream_gives_the_same_interval_and_the_mean_that_of_the_normal_law() -> None:
    of = [np.random.default_rng(3).normal(size=400)]
    first, again = (averages(of, stream(0, "t"))[1] for _ in range(2))
    assert first == again
    assert first.high - first.low == pytest.approx(2 * 1.96 * of[0].std() / 20, rel=0.05)


@given(SCORES, st.floats(0.1, 5), st.floats(-2, 2))
def test_averages_scale_and_shift_with_the_scores(
    scores: list[list[float]], scale: float, shift: float
) -> None:
    of = groups(scores)
    moved = [scale * group + shift for group in of]
    for a, b in zip(averages(of, stream(0, "t"), 50), averages(moved, stream(0, "t"), 50), strict=True):
        expected = [scale * value + shift for value in (a.value, a.low, a.high)]
        assert [b.value, b.low, b.high] == pytest.approx(expected, abs=1e-9)


def test_one_run_of_a_task_has_a_value_and_no_interval() -> None:
    middle_, mean = averages(groups([[0.5], [0.6, 0.8]]), stream(0, "t"))
    assert mean.value == pytest.approx(1.9 / 3)
    assert np.isnan([middle_.low, mean.low, mean.high]).all()
    assert np.isnan(averages([], stream(0, "t"))[0].value)


def test_improvement_counts_pairs_task_by_task() -> None:
    a, b = groups([[3.0, 1.0], [0.0, 0.0]]), groups([[2.0, 0.5, 1.0], [0.0, 1.0]])
    # 3 beats all three, 1 beats one and ties one; of the second task a half and a loss, twice
    expected = ((3 + 1.5) / 6 + (0.5 + 0.0) / 2) / 2
    found = improvement(a, b, stream(0, "t"))
    assert found.value == pytest.approx(expected)
    assert 0 <= found.low <= found.value <= found.high <= 1
    assert improvement(a, b, stream(0, "t")) == found


@given(SCORES)
def test_a_method_is_no_improvement_on_itself_and_what_one_gains_the_other_loses(scores) -> None:
    of = groups(scores)
    assert improvement(of, of, stream(0, "t"), 10).value == pytest.approx(0.5)
    better = [group + 10 for group in of]
    found = improvement(better, of, stream(0, "t"), 10)
    assert (found.value, found.low, found.high) == (1.0, 1.0, 1.0)
    other = [group[::-1] * 0.7 + 0.1 for group in of]
    both = improvement(of, other, stream(0, "t"), 10).value + improvement(other, of, stream(0, "t"), 10).value
    assert both == pytest.approx(1.0)


def test_other_numbers_of_tasks_do_not_compare() -> None:
    with pytest.raises(ValueError, match="expected the same tasks of both: 1 != 2"):
        improvement(groups([[1.0, 2.0]]), groups([[1.0], [2.0]]), stream(0, "t"))


def test_steps_to_are_of_the_first_evaluation_that_is_there() -> None:
    curve = [[10, 20.0], [20, 95.0], [30, 60.0], [40, 100.0]]
    found = [steps_to(curve, share, lambda value: value / 100) for share in (0.5, 0.9, 1.0, 1.1)]
    assert found == [20, 20, 40, None]
    assert middle([]) is None
    assert middle([10.0, 20.0, None]) == 20.0
    assert middle([10.0, None]) is None


@pytest.mark.parametrize(("tasks", "held"), [(5, 0.85), (1, 0.75)])
def test_intervals_over_three_seeds_hold_the_mean_as_seldom_as_the_tables_say(
    tasks: int, held: float
) -> None:
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(600):
        _, mean = averages([rng.normal(size=3) for _ in range(tasks)], rng, draws=400)
        assert mean.low is not None
        assert mean.high is not None
        inside.append(mean.low <= 0.0 <= mean.high)
    # four standard errors
    assert np.mean(inside) == pytest.approx(held, abs=4 * (held * (1 - held) / 600) ** 0.5)
