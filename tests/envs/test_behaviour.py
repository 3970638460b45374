"""What is done to a policy's actions is what was asked for, and the same for the same episode."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from irl.core.errors import UserError
from irl.core.types import Episode
from irl.envs.behaviour import Behaviour, behaving
from irl.envs.make import make
from irl.envs.rollouts import record
from irl.policies.policy import Policy
from tests import pointmass

STILL = np.zeros(2)


def still(obs: np.ndarray) -> np.ndarray:
    return STILL


def actions(how: Behaviour, n: int, seed: int = 0, episode: int = 0, act=still) -> np.ndarray:
    env = make("PointMass-v0")
    behave = behaving(act, how, env.action_space, seed, episode)
    env.close()
    return np.array([behave(np.zeros(2)) for _ in range(n)])


def test_nothing_is_done_unless_asked() -> None:
    env = make("PointMass-v0")
    assert behaving(still, Behaviour(), env.action_space, 0, 0) is still
    env.close()


def test_noise_has_its_deviation_and_no_mean() -> None:
    found = actions(Behaviour(noise=0.3), 4000)
    assert found.mean() == pytest.approx(0.0, abs=0.02)
    assert found.std() == pytest.approx(0.3, rel=0.04)


def test_random_actions_come_as_often_as_asked_and_are_uniform() -> None:
    found = actions(Behaviour(random=0.25), 4000)
    random = found[(found != 0.0).any(axis=1)]
    assert len(random) / 4000 == pytest.approx(0.25, abs=0.03)
    assert random.std() == pytest.approx(1 / np.sqrt(3), rel=0.05)
    assert np.abs(random).max() <= 1.0


def test_draws_are_of_the_policys_own_distribution() -> None:
    policy = pointmass.expert()
    found = actions(Behaviour(stochastic=True), 4000, act=policy)
    # clip(-5 x) with a log deviation of -2
    assert found.std() == pytest.approx(np.exp(-2), rel=0.04)
    with pytest.raises(UserError, match="no distribution"):
        actions(Behaviour(stochastic=True), 1)
    weights = {name: value for name, value in policy.weights.items() if name != "log_std"}
    of_td3 = Policy(replace(policy.spec, distribution="deterministic"), weights)
    with pytest.raises(UserError, match="no distribution"):
        actions(Behaviour(stochastic=True), 1, act=of_td3)


def test_an_episode_is_the_same_whatever_was_played_before_it() -> None:
    env = make("PointMass-v0")
    how = Behaviour(noise=0.1, random=0.2, stochastic=True)

    def played(seed: int, episode: int) -> Episode:
        act = behaving(pointmass.expert(), how, env.action_space, seed, episode)
        return record(env, act, episode)[0]

    first, _, again = played(0, 3), played(0, 4), played(0, 3)
    np.testing.assert_array_equal(first.action, again.action)
    assert not np.array_equal(first.action, played(1, 3).action)
    env.close()


def test_a_choice_has_random_actions_and_no_noise() -> None:
    env = make("CartPole-v1")
    with pytest.raises(UserError, match="--random-actions"):
        behaving(still, Behaviour(noise=0.1), env.action_space, 0, 0)
    behave = behaving(lambda obs: np.array([1.0, 0.0]), Behaviour(random=1.0), env.action_space, 0, 0)
    assert {tuple(behave(np.zeros(4))) for _ in range(30)} == {(1.0, 0.0), (0.0, 1.0)}
    env.close()


@pytest.mark.parametrize("wrong", [{"noise": -0.1}, {"noise": np.inf}, {"random": 1.1}, {"random": -0.1}])
def test_what_cannot_be(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="must"):
        Behaviour(**wrong)
