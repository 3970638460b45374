"""A snapshot is chosen without the truth: a planted best one wins, and what is missing is left out."""

import math

import numpy as np
import pytest

from irl.diagnostics.choosing import Criteria, beside, choose, disagreement

GOOD, BAD = Criteria(0.1, 0.1, 0.1), Criteria(0.4, 0.5, 0.6)


def test_the_one_that_is_best_in_all_is_chosen_whatever_the_units() -> None:
    for scale in (1.0, 1000.0):
        bad = Criteria(BAD.loss * scale, BAD.unstable, BAD.disagrees)
        found = choose({0: GOOD, 10: bad, 20: GOOD, 30: bad})
        assert found.step == 20
        assert found.ranks[20] == 1.0
        assert math.isnan(found.ranks[0])


def test_of_equals_the_later_and_a_criterion_that_is_not_known_is_left_out() -> None:
    assert choose({0: BAD, 10: GOOD, 20: GOOD}).step == 20
    unknown = {10: Criteria(math.nan, 0.1, 0.1), 20: Criteria(0.1, 0.5, 0.5)}
    assert choose(unknown).step == 10


def test_what_it_cannot_do_is_said() -> None:
    with pytest.raises(ValueError, match="no snapshot after step 0"):
        choose({0: GOOD})
    with pytest.raises(ValueError, match="no criterion"):
        choose({0: GOOD, 10: Criteria(math.nan, math.nan, math.nan)})


def test_a_snapshot_is_beside_one_neighbour_or_two() -> None:
    np.testing.assert_allclose(beside(np.array([1.0, 3.0, 5.0])), [1.0, 2.0, 4.0, 5.0])
    learned = np.array([[1.0, 2.0, 3.0], [10.0, 20.0, 30.0], [3.0, 2.0, 1.0]])
    np.testing.assert_allclose(disagreement(learned), [0.0, 1.0, 2.0])
