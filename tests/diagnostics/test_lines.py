import numpy as np
import pytest

from irl.core.rng import stream
from irl.diagnostics.lines import line


def test_the_slope_is_that_of_least_squares_and_lies_in_its_interval() -> None:
    rng = stream(0, "lines")
    x = rng.normal(size=400)
    y = 0.7 * x - 2.0 + 0.1 * rng.normal(size=400)
    found = line(x, y, np.repeat(np.arange(20), 20), rng)
    assert (found.slope, found.intercept) == pytest.approx(tuple(np.polyfit(x, y, 1)))
    assert found.low < 0.7 < found.high
    assert (found.size, found.episodes) == (400, 20)


def test_one_episode_has_a_slope_and_no_interval() -> None:
    found = line(np.arange(3.0), np.arange(3.0), np.zeros(3, dtype=np.int64), stream(0, "lines"))
    assert found.slope == pytest.approx(1.0)
    assert np.isnan(found.low)


def test_a_constant_has_no_slope() -> None:
    found = line(np.ones(4), np.arange(4.0), np.arange(4), stream(0, "lines"))
    assert np.isnan(found.slope)
