"""What else a reward pays for: planted, and found on episodes that were left out."""

from dataclasses import replace

import numpy as np
import pytest

from irl.diagnostics.residual import Residual, residual, seen
from tests.diagnostics.test_terms import EPISODES, GAMMA, SCALE, shaped


def left_over(planted, size: float = 0.1) -> Residual:
    rng = np.random.default_rng(3)
    learned = [
        SCALE * e.reward + shaped(e) + 0.5 + planted(e) + size * rng.normal(size=len(e)) for e in EPISODES
    ]
    return residual(EPISODES, learned, gamma=GAMMA, rng=np.random.default_rng(0))


def test_a_planted_pay_is_found_and_named() -> None:
    found = left_over(lambda e: 2.0 * np.sin(2.0 * e.action[:, 0]))
    assert found.r2 > 0.8
    assert next(iter(found.importance)) == "action[0]"
    assert found.importance["action[0]"] > 0.8
    assert max(v for name, v in found.importance.items() if name != "action[0]") < 0.1
    assert 0.0 < found.share < 1.0


def test_where_nothing_else_is_paid_for_nothing_is_found() -> None:
    found = left_over(lambda e: np.zeros(len(e)), size=0.3)
    assert found.r2 < 0.05
    assert max(found.importance.values()) < 0.05


def test_columns_are_named_in_their_order() -> None:
    names, x = seen(EPISODES[:2])
    assert names == ["obs[0]", "obs[1]", "action[0]", "change of obs[0]", "change of obs[1]"]
    np.testing.assert_array_equal(x[:150, 4], np.diff(EPISODES[0].obs[:, 1]))


def test_the_same_generator_gives_the_same_and_what_it_cannot_do_is_said() -> None:
    assert left_over(lambda e: e.obs[1:, 0]) == left_over(lambda e: e.obs[1:, 0])
    for episodes, learned, message in (
        (EPISODES[:3], [e.reward for e in EPISODES[:3]], "fewer than 5"),
        (EPISODES, [np.ones(len(e)) for e in EPISODES], "constant"),
        ([replace(e, terms={}) for e in EPISODES], [e.reward for e in EPISODES], "no term"),
    ):
        with pytest.raises(ValueError, match=message):
            residual(episodes, learned, gamma=GAMMA, rng=np.random.default_rng(0))
