import numpy as np
import pytest

from irl.core import statistics
from irl.core.rng import stream
from irl.diagnostics import bootstrap
from irl.diagnostics.segments import Segments
from irl.diagnostics.stack import stack
from tests.diagnostics.test_segments import episode


def data(episodes: int = 30, length: int = 20, seed: int = 0):
    """Columns whose episodes share a level, as those of a policy do."""
    rng = stream(seed, "data")
    half = [episode(length, True)] * (episodes // 2)
    layout = stack({"a": half, "b": half})
    level = np.repeat(rng.normal(size=(episodes, 2)), length, axis=0)
    values = level @ np.array([[1.0, 0.7], [0.0, 0.7]]) + 0.1 * rng.normal(size=(len(level), 2))
    return Segments(values, layout.layout.episode), layout.layout


def test_the_fast_way_is_the_slow_way() -> None:
    sums, layout = data()
    drawn = bootstrap.counts(layout, 40, stream(0, "draws"))
    fast = bootstrap.correlations(sums, 0, drawn)[:, 1]
    np.testing.assert_allclose(fast, bootstrap.statistic(statistics.pearson, sums, (0, 1), drawn), atol=1e-10)


def test_every_stratum_keeps_its_size() -> None:
    _, layout = data()
    drawn = bootstrap.counts(layout, 50, stream(0, "draws"))
    assert set(drawn[:, layout.stratum == 0].sum(1).tolist()) == {15}
    assert drawn.shape == (50, 30)


def test_strata_need_not_lie_one_after_the_other() -> None:
    mixed = np.array([1, 0, 1, 1, 0, 2])
    drawn = bootstrap.within(mixed, 200, stream(0, "draws"))
    assert [set(drawn[:, mixed == one].sum(1).tolist()) for one in range(3)] == [{2}, {3}, {1}]
    assert drawn[:, mixed == 1].std() > 0


def test_the_interval_holds_the_truth_about_as_often_as_it_says() -> None:
    # 0.7 by construction, up to the noise in each column
    true, held = 0.7 / np.sqrt((1 + 0.01) * (0.98 + 0.01)), 0
    for seed in range(100):
        sums, layout = data(seed=seed)
        drawn = bootstrap.counts(layout, 200, stream(seed, "draws"))
        low, high = bootstrap.interval(bootstrap.correlations(sums, 0, drawn)[:, 1])
        held += low <= true <= high
    # of 95 %, from 30 episodes: a few too narrow; an interval of everything would hold it each time
    assert 85 <= held <= 98


def test_steps_of_one_episode_count_as_one() -> None:
    few, many = data(episodes=10, length=200), data(episodes=100, length=20)
    widths = []
    for sums, layout in (few, many):
        drawn = bootstrap.counts(layout, 300, stream(0, "draws"))
        low, high = bootstrap.interval(bootstrap.correlations(sums, 0, drawn)[:, 1])
        widths.append(high - low)
    assert widths[0] > 2 * widths[1]


def test_undefined_resamples_leave_no_interval() -> None:
    assert np.isnan(bootstrap.interval(np.array([0.1] * 8 + [np.nan] * 2))[0])
    assert bootstrap.interval(np.linspace(0, 1, 101)) == pytest.approx((0.025, 0.975))
