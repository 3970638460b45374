"""The hand-written reward is what was recorded."""

import numpy as np
import pytest
import torch

from irl.core.types import RewardFn, Transitions, from_episodes
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollout
from irl.rewards.mujoco import HandWritten


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
