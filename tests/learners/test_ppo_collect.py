"""The rollout is the one that Stable-Baselines3 collects."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from irl.core.types import Transitions
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.ppo_rollout import by_sb3
from tests import pointmass  # noqa: F401  registers the tasks

SMALL = PPOConfig(n_envs=3, steps_per_round=192, batch_size=64, hidden=(16, 8), n_epochs=2, log_std_init=0.5)


def learner(env_id: str, **changes: Any) -> PPOLearner:
    return PPOLearner(env_id, [0, 1, 2], replace(SMALL, **changes), seed=0, total_steps=1920)


def zeros(batch: Transitions) -> torch.Tensor:
    return torch.zeros(len(batch))


@pytest.mark.parametrize("env_id", ["Cliff-v0", "PointMass-v0", "Hopper-v5"])
@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_rollouts_are_those_of_sb3_from_the_same_seed(env_id: str, activation: str) -> None:
    ours, its = (learner(env_id, activation=activation) for _ in range(2))
    _, callback = its.model._setup_learn(SMALL.steps_per_round, callback=None)
    its._fill = by_sb3(its.model, its.venv, callback)
    batches, next_drawn = [], []
    for of in (ours, its):
        torch.manual_seed(0)
        batches.append(of.collect())
        next_drawn.append(torch.rand(3))
    assert torch.equal(*next_drawn)
    mine, theirs = batches
    for name in ("obs", "action", "next_obs", "terminated", "truncated", "reward"):
        assert torch.equal(getattr(mine, name), getattr(theirs, name)), name
    assert (mine.terminated | mine.truncated).any()
    mine, theirs = ours.model.rollout_buffer, its.model.rollout_buffer
    for name in ("observations", "actions", "episode_starts"):
        np.testing.assert_array_equal(getattr(mine, name), getattr(theirs, name), err_msg=name)
    for name in ("values", "log_probs"):
        np.testing.assert_allclose(
            getattr(mine, name), getattr(theirs, name), rtol=1e-5, atol=2e-6, err_msg=name
        )
    assert ours.env_steps == its.env_steps == SMALL.steps_per_round
    np.testing.assert_array_equal(ours.model._last_obs, its.model._last_obs)
    np.testing.assert_array_equal(ours.model._last_episode_starts, its.model._last_episode_starts)


def test_a_rollout_goes_on_where_the_one_before_ended() -> None:
    ours = learner("PointMass-v0")
    first, _, second = ours.collect(), ours.improve(zeros), ours.collect()
    ended = first.terminated[-3:] | first.truncated[-3:]
    assert not ended.any()
    assert torch.equal(second.obs[:3], first.next_obs[-3:])
