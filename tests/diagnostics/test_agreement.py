import numpy as np
import pytest

from irl.core.rng import stream
from irl.diagnostics.agreement import per_episode, per_step


def test_offset_and_scale_do_not_count_against_the_learned_reward() -> None:
    hand_written = stream(0, "test").normal(size=200)
    agreement = per_step(3 + 0.1 * hand_written, hand_written)
    assert agreement.pearson == pytest.approx(1)
    assert agreement.spearman == pytest.approx(1)
    assert (agreement.n, agreement.reason) == (200, None)


def test_a_constant_hand_written_reward_is_a_reason_not_a_zero() -> None:
    agreement = per_step(np.arange(5.0), np.ones(5))
    assert np.isnan(agreement.pearson)
    assert np.isnan(agreement.spearman)
    assert agreement.reason == "the hand-written reward is constant on these steps"


def test_a_constant_learned_reward_is_named_too() -> None:
    assert per_step(np.ones(5), np.arange(5.0)).reason == "the learned reward is constant on these steps"


def test_numbers_that_are_not_finite_are_counted() -> None:
    agreement = per_step(np.arange(3.0), np.array([1.0, np.nan, 2.0]))
    assert agreement.reason == "the hand-written reward is not finite on 1 of these 3 steps"


def test_episodes_are_compared_by_their_sums() -> None:
    learned = [np.array([1.0, 1.0]), np.array([3.0]), np.array([0.0, 0.0, 7.0])]
    hand_written = [np.array([0.0, 2.0]), np.array([3.0]), np.array([7.0, 0.0, 0.0])]
    agreement = per_episode(learned, hand_written)
    assert agreement.pearson == pytest.approx(1)
    assert agreement.n == 3


def test_episodes_of_one_return_have_no_correlation() -> None:
    learned = [np.arange(2.0), np.arange(3.0)]
    agreement = per_episode(learned, [np.array([1.0, 1.0]), np.array([0.0, 0.0, 2.0])])
    assert agreement.reason == "the hand-written return is constant on these episodes"


@pytest.mark.parametrize("n", [0, 1])
def test_fewer_than_two_episodes_is_a_reason(n: int) -> None:
    agreement = per_episode([np.ones(4)] * n, [np.ones(4)] * n)
    assert np.isnan(agreement.pearson)
    assert agreement.reason == f"a correlation needs two episodes or more, there are {n}"


def test_episodes_of_different_length_are_refused_with_the_numbers() -> None:
    with pytest.raises(ValueError, match=r"\[2\] != \[3\]"):
        per_episode([np.ones(2)], [np.ones(3)])
