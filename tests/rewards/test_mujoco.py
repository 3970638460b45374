"""The hand-written reward is what was recorded."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from irl.core.errors import UserError
from irl.core.types import Episode, RewardFn, Transitions, from_episodes
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollout, rollouts
from irl.envs.tasks import TASKS
from irl.rewards.from_steps import RULES
from irl.rewards.mujoco import HandWritten, terms_of_info, with_terms


def test_reward_and_terms_of_a_live_task():
    env = make("Hopper-v5")
    episode = rollout(env, random_act(env.action_space, np.random.default_rng(0)), 0)
    env.close()
    batch = from_episodes([episode])
    reward: RewardFn = HandWritten()
    np.testing.assert_array_equal(reward(batch).numpy(), episode.reward)
    terms = HandWritten().terms(batch)
    assert set(terms) == {"forward", "ctrl", "survive"}
    torch.testing.assert_close(torch.stack(list(terms.values())).sum(0), reward(batch), rtol=0, atol=1e-12)


def test_what_was_not_recorded_is_not_invented():
    flags = torch.zeros(2, dtype=torch.bool)
    batch = Transitions(torch.zeros(2, 3), torch.zeros(2, 1), torch.zeros(2, 3), flags, flags)
    with pytest.raises(ValueError, match="2 transitions were recorded without the environment's reward"):
        HandWritten()(batch)
    with pytest.raises(ValueError, match="without the terms"):
        HandWritten().terms(batch)


def played(env_id: str, seeds: range = range(2)) -> list[Episode]:
    """Random actions, at most 60 steps of each seed."""
    env = make(env_id)
    act = random_act(env.action_space, np.random.default_rng(0))
    env.close()
    return rollouts(f'{env_id}?{{"max_episode_steps":60}}' if "?" not in env_id else env_id, act, seeds)


@pytest.mark.parametrize("env_id", RULES)
def test_terms_of_a_live_step_add_up_to_its_reward(env_id: str):
    env = make(env_id)
    act = random_act(env.action_space, np.random.default_rng(0))
    obs, _ = env.reset(seed=0)
    for _ in range(5):
        obs, reward, _, _, info = env.step(act(obs).astype(np.float32))
        terms = terms_of_info(env_id, info)
        assert sum(terms.values()) == pytest.approx(float(reward), abs=1e-12)
    env.close()
    with pytest.raises(UserError, match=f"info of {env_id} lacks"):
        terms_of_info(env_id, {})


@pytest.mark.parametrize("env_id", RULES)
def test_terms_worked_out_of_steps_are_those_of_the_infos(env_id: str):
    for episode in played(env_id):
        bare = replace(episode, terms={}, infos={})
        found = with_terms(bare, env_id).terms
        assert list(found) == list(episode.terms)
        for name, values in found.items():
            np.testing.assert_allclose(values, episode.terms[name], rtol=0, atol=1e-12, err_msg=name)
        np.testing.assert_allclose(sum(found.values()), episode.reward, rtol=0, atol=1e-12)


def test_every_task_of_the_table_has_a_rule():
    assert list(RULES) == [task.env_id for task in TASKS]


def test_the_last_step_of_a_fall_does_not_survive():
    (episode,) = played("Hopper-v5", range(1))
    assert episode.terminated
    np.testing.assert_array_equal(
        with_terms(replace(episode, terms={}), "Hopper-v5").terms["survive"],
        [1.0] * (len(episode) - 1) + [0.0],
    )


def test_weights_that_a_task_is_given_are_used():
    env_id = 'Hopper-v5?{"ctrl_cost_weight":0.5,"forward_reward_weight":3.0,"healthy_reward":2.0}'
    (episode,) = played(env_id, range(1))
    found = with_terms(replace(episode, terms={}), env_id).terms
    for name, values in episode.terms.items():
        np.testing.assert_allclose(found[name], values, rtol=0, atol=1e-12)


def test_what_does_not_tell_the_terms_is_refused():
    (episode,) = played("InvertedDoublePendulum-v5", range(1))
    fast = replace(episode, obs=episode.obs + np.eye(9)[7] * 20)
    unpaid = replace(episode, reward=np.full(len(episode), np.nan))
    for wrong, env_id, said in (
        (fast, "InvertedDoublePendulum-v5", "velocity at step 0 is at 10"),
        (unpaid, "InvertedDoublePendulum-v5", "expected observations of 9, and rewards"),
        (episode, "Hopper-v5", "observations of 9 .* expected observations of 11"),
        (episode, "Pendulum-v1", "'Pendulum-v1' are not known; those of Hopper-v5"),
        (episode, 'Hopper-v5?{"terminate_when_unhealthy":false}', "with terminate_when_unhealthy"),
    ):
        with pytest.raises(UserError, match=said):
            with_terms(wrong, env_id)
