import numpy as np
import pytest

from irl.core.rng import stream
from irl.core.types import Episode
from irl.diagnostics.segments import WHOLE, segments
from irl.diagnostics.stack import stack

ENDS = [(7, True), (5, False), (1, True), (9, False)]


def episode(length: int, terminated: bool) -> Episode:
    obs, action = np.zeros((length + 1, 1)), np.zeros((length, 1))
    return Episode(obs, action, np.zeros(length), terminated, not terminated)


def layout():
    return stack({"a": [episode(*ENDS[0]), episode(*ENDS[1])], "b": [episode(*e) for e in ENDS[2:]]}).layout


@pytest.mark.parametrize("n", [1, 3, 6, 20, WHOLE])
def test_every_sum_is_what_a_loop_says(n: int) -> None:
    x, gamma, start, expected, of = stream(0, "x").normal(size=(22, 2)), 0.8, 0, [], []
    for number, (length, terminated) in enumerate(ENDS):
        for t in range(1 if n == WHOLE else length):
            steps = length if n == WHOLE else n
            if t + steps > length and not terminated:
                continue
            rows = x[start + t : start + min(t + steps, length)]
            expected.append(sum(gamma**k * row for k, row in enumerate(rows)))
            of.append(number)
        start += length
    found = segments(x, layout(), gamma, n)
    np.testing.assert_allclose(found.values, np.array(expected), atol=1e-12)
    assert found.episode.tolist() == of


def test_no_segment_reaches_past_a_time_limit() -> None:
    assert len(segments(np.ones((22, 1)), layout(), 0.9, 8).values) == 7 + 1 + 2


def test_columns_of_other_steps_are_refused() -> None:
    with pytest.raises(ValueError, match="21 steps, where 22"):
        segments(np.ones((21, 1)), layout(), 0.9, 1)


def test_the_halves_of_a_cross_fit_split_every_stratum() -> None:
    assert layout().fold.tolist() == [0, 1, 1, 0]
    assert stack({"a": [episode(3, True)]}).layout.fold.tolist() == [0]
