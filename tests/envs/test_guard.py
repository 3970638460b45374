"""An environment that does wrong is named with its step; one that does right is not changed."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from irl.core.errors import UserError
from irl.envs.guard import Guarded
from irl.envs.make import VARIABLE, check_module, make
from irl.envs.rollouts import rollout
from tests.malformed.environments import FAULTY
from tests.pointmass import PointMass


def guarded(fault: str) -> Guarded:
    return Guarded(gym.wrappers.TimeLimit(FAULTY[fault](), 30), "Task-v0")


def still(obs: np.ndarray) -> np.ndarray:
    return np.zeros(2)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("raises at reset", r"^the reset of Task-v0 \(seed 7\) raised ZeroDivisionError: a bug"),
        ("raises at a step", r"^the step 12 of Task-v0 \(seed 7\) raised ZeroDivisionError: a bug"),
        ("nan at reset", r"^Task-v0 gave an observation with nan in column 1 at its reset \(seed 7\)"),
        ("nan at a step", r"^Task-v0 gave an observation with nan in column 1 after step 12 \(seed 7\)"),
        ("another shape", r"^Task-v0 gave an observation of shape \(1,\) after step 12 .* says \(2,\)"),
    ],
)
def test_what_went_wrong_is_said_with_its_step(fault: str, message: str) -> None:
    with pytest.raises(UserError, match=message) as caught:
        rollout(guarded(fault), still, seed=7)
    assert "having been given" not in str(caught.value)


def test_an_action_that_is_no_number_is_named_as_the_likelier_cause() -> None:
    env = Guarded(PointMass(), "Task-v0")
    env.reset(seed=0)
    with pytest.raises(UserError, match=r"nan in column 0 .*having been given the action \[nan"):
        env.step(np.full(2, np.nan))


def test_a_second_episode_counts_its_steps_anew() -> None:
    env = guarded("nan at a step")
    for _ in range(2):
        with pytest.raises(UserError, match="after step 12"):
            rollout(env, still, seed=1)


class ARow(gym.RewardWrapper):
    """Pays a row of one number."""

    def reward(self, reward: Any) -> Any:
        return np.array([reward])


def test_a_reward_that_is_a_row_is_refused_before_anything_is_made_of_it() -> None:
    with pytest.raises(UserError, match=r"^Task-v0 gave a reward of shape \(1,\) after step 0 \(seed 7\)"):
        rollout(Guarded(ARow(gym.make("PointMass-v0")), "Task-v0"), still, seed=7)


def test_an_environment_that_does_right_is_as_it_was() -> None:
    env, plain = make("PointMass-v0"), gym.make("PointMass-v0", disable_env_checker=True)
    assert env.spec == plain.spec
    for seed in (0, 1):
        a, b = rollout(env, still, seed), rollout(plain, still, seed)
        np.testing.assert_array_equal(a.obs, b.obs)
        np.testing.assert_array_equal(a.reward, b.reward)
    env.close()
    plain.close()


def test_a_module_is_imported_on_the_word_of_a_user_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    check_module("Hopper-v5", "a file")
    # imported already: nothing new is run
    check_module("tests.pointmass:PointMass-v0", "a file")
    with pytest.raises(UserError, match=f"^a file names .*'antigravity'.* allow it: {VARIABLE}=antigravity$"):
        check_module("antigravity:Env-v0", "a file")
    monkeypatch.setenv(VARIABLE, "antigravity")
    check_module("antigravity:Env-v0", "a file")
    with pytest.raises(UserError):
        check_module("antigravity.other:Env-v0", "a file")
