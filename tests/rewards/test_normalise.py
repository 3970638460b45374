import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from irl.core import state
from irl.core.rng import stream
from irl.rewards.normalise import DrawnScale, ReturnScale


def slow_returns(reward: np.ndarray, done: np.ndarray, gamma: float) -> list[float]:
    """The discounted return of every step, one environment after the other."""
    found = []
    for env in range(reward.shape[1]):
        running = 0.0
        for r, ended in zip(reward[:, env], done[:, env], strict=True):
            running = gamma * running + r
            found.append(running)
            if ended:
                running = 0.0
    return found


def rollout(seed: int, steps: int, envs: int) -> tuple[np.ndarray, np.ndarray]:
    rng = stream(seed, "test")
    return rng.normal(2.0, 3.0, (steps, envs)), rng.random((steps, envs)) < 0.2


@given(
    st.integers(0, 1000),
    st.integers(2, 30),
    st.integers(1, 4),
    st.sampled_from([0.0, 0.9, 0.99]),
    st.integers(0, 30),
)
def test_it_is_the_deviation_of_every_environments_returns(seed, steps, envs, gamma, cut) -> None:
    reward, done = rollout(seed, steps, envs)
    expected = np.std(slow_returns(reward, done, gamma))
    whole, pieces = ReturnScale(envs, gamma), ReturnScale(envs, gamma)
    whole.update(reward, done)
    for part in (slice(None, cut), slice(cut, None)):
        if len(reward[part]):
            pieces.update(reward[part], done[part])
    assert whole.std == pytest.approx(expected, rel=1e-10)
    assert pieces.std == pytest.approx(expected, rel=1e-10)


def test_a_return_starts_at_nothing_after_an_episodes_end() -> None:
    reward, done = np.ones((4, 1)), np.array([[False], [True], [False], [True]])
    scale = ReturnScale(1, 0.5)
    scale.update(reward, done)
    # returns 1, 1.5, 1, 1.5
    assert scale.std == pytest.approx(0.25, abs=1e-15)


def test_environments_do_not_mix() -> None:
    reward = np.array([[1.0, 0.0], [0.0, 0.0]])
    scale = ReturnScale(2, 1.0)
    scale.update(reward, np.zeros((2, 2), dtype=bool))
    # returns 1, 1 in the first and 0, 0 in the second
    assert scale.std == pytest.approx(0.5, abs=1e-15)


@given(st.floats(1e-3, 1e3), st.floats(-5, 5))
def test_it_follows_the_rewards_scale(factor: float, gamma_free_shift: float) -> None:
    reward, done = rollout(0, 20, 3)
    one, other, shifted = ReturnScale(3, 0.9), ReturnScale(3, 0.9), ReturnScale(3, 0.0)
    one.update(reward, done)
    other.update(factor * reward, done)
    shifted.update(reward + gamma_free_shift, done)
    assert other.std == pytest.approx(factor * one.std, rel=1e-9)
    # without discounting backwards the return is the reward, whose deviation ignores a shift
    assert shifted.std == pytest.approx(reward.std(), rel=1e-9)


def test_before_there_is_a_spread_it_changes_nothing() -> None:
    scale = ReturnScale(1, 0.9)
    assert scale.std == 1.0
    scale.update(np.array([[5.0]]), np.array([[False]]))
    assert scale.std == 1.0
    scale.update(np.array([[5.0]]), np.array([[False]]))
    # returns 5 and 9.5
    assert scale.std == pytest.approx(2.25)


def test_a_constant_return_changes_nothing() -> None:
    scale = ReturnScale(2, 0.9)
    scale.update(np.zeros((5, 2)), np.zeros((5, 2), dtype=bool))
    assert scale.std == 1.0


def test_it_goes_on_where_it_was(tmp_path) -> None:
    first, second = rollout(0, 10, 3), rollout(1, 10, 3)
    scale, other = ReturnScale(3, 0.9), ReturnScale(3, 0.9)
    scale.update(*first)
    state.save(tmp_path, scale.state_dict())
    kept = scale.state_dict()
    scale.update(*second)
    for saved in (state.load(tmp_path), kept):
        other.load_state_dict(saved)
        assert other.std != scale.std
        other.update(*second)
        assert other.std == scale.std


def test_without_a_scale_the_deviation_counts_as_one_and_a_bound_is_after_the_scale() -> None:
    reward, done = rollout(0, 50, 2)
    plain, bounded = ReturnScale(2, 0.9, scaled=False), ReturnScale(2, 0.9, clip=0.5)
    for scale in (plain, bounded):
        scale.update(reward, done)
    assert plain.std == 1.0
    assert np.array_equal(plain(reward), reward)
    assert np.array_equal(bounded(reward), np.clip(reward / bounded.std, -0.5, 0.5))


def test_the_deviation_of_drawn_rewards_is_that_of_all_of_them_and_goes_on() -> None:
    drawn = torch.randn(7, 20, generator=torch.Generator().manual_seed(0)) * 3.0 + 5.0
    scale, off = DrawnScale(scaled=True, clip=0.0), DrawnScale(scaled=False, clip=2.0)
    given = [scale(batch) for batch in drawn][-1]
    assert scale.std == pytest.approx(float(drawn.double().std(correction=0)))
    torch.testing.assert_close(given, drawn[-1] / scale.std)
    other = DrawnScale(scaled=True, clip=0.0)
    other.load_state_dict(scale.state_dict())
    assert torch.equal(other(drawn[0]), scale(drawn[0]))
    assert torch.equal(off(drawn[0]), drawn[0].clamp(-2.0, 2.0))
    assert off.std == 1.0


def test_equal_and_single_rewards_are_left_as_they_are() -> None:
    scale = DrawnScale(scaled=True, clip=0.0)
    assert torch.equal(scale(torch.full((1,), 4.0)), torch.full((1,), 4.0))
    assert torch.equal(scale(torch.full((3,), 4.0)), torch.full((3,), 4.0))
