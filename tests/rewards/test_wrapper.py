"""A learned reward in a Gymnasium program, against the same reward of the steps recorded by hand."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch

import irl
from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import RewardFn, Transitions, from_episodes
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollouts
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.wrapper import RewardWrapper
from tests import pointmass


def learned(env_id: str, shape: LogitSpec, batch: Transitions) -> LearnedReward:
    spec = RewardSpec(env_id, "dac", "logit", "obs, action", shape, 0.95, 1.0, 0, {})
    return LearnedReward(spec, LogitNet(shape, fitted_normaliser(batch.obs), torch_stream(0, "net")))


def random_steps(env_id: str, seeds: range) -> Transitions:
    env = make(env_id)
    return from_episodes(rollouts(env_id, random_act(env.action_space, np.random.default_rng(0)), seeds))


def replayed(env: gym.Env, seeds: range) -> tuple[list[float], list[float], list[dict[str, Any]]]:
    """Rewards, own rewards and infos of the same random actions."""
    act = random_act(env.action_space, np.random.default_rng(0))
    rewards, infos = [], []
    for seed in seeds:
        obs, _ = env.reset(seed=seed)
        done = False
        while not done:
            obs, reward, terminated, truncated, info = env.step(act(obs).astype(np.float32))
            assert isinstance(reward, float)
            rewards.append(reward)
            infos.append(info)
            done = terminated or truncated
    return rewards, [info["own_reward"] for info in infos], infos


@pytest.mark.parametrize("scale", [0.0, 10.0], ids=["gail", "dac"])
def test_in_hopper_it_pays_what_the_learned_reward_says_of_the_recorded_steps(scale: float) -> None:
    recorded, seeds = random_steps("Hopper-v5", range(4)), range(4)
    assert int(recorded.terminated.sum()) == 4
    reward = learned("Hopper-v5", LogitSpec(11, 3, (16,), absorbing_scale=scale), recorded)
    rewards, own, infos = replayed(irl.RewardWrapper(make("Hopper-v5"), reward), seeds)
    np.testing.assert_allclose(rewards, reward(recorded), rtol=1e-4, atol=1e-5)
    assert recorded.reward is not None
    np.testing.assert_allclose(own, recorded.reward)
    # the environment's own infos are still there
    assert all("reward_forward" in info for info in infos)
    # falls are paid with the tail of the absorbing state, and only there
    plain = reward.logits(recorded)
    assert isinstance(reward.net, LogitNet)
    tail = 0.95 / 0.05 * float(reward.net.of_absorbing()) if scale else 0.0
    np.testing.assert_allclose(
        np.array(rewards) - plain.numpy(), tail * recorded.terminated.numpy(), atol=1e-4
    )


def test_a_time_limit_gets_no_tail() -> None:
    recorded = random_steps("PointMass-v0", range(2))
    reward = learned("PointMass-v0", LogitSpec(2, 2, (8,), absorbing_scale=10.0), recorded)
    rewards, _, _ = replayed(RewardWrapper(gym.make("PointMass-v0"), reward), range(2))
    assert len(rewards) == 2 * pointmass.STEPS
    np.testing.assert_allclose(rewards, reward.logits(recorded), rtol=1e-4, atol=1e-5)


class Seen:
    """A reward that keeps what it was asked about."""

    def __init__(self) -> None:
        self.batches: list[Transitions] = []

    def __call__(self, batch: Transitions) -> torch.Tensor:
        self.batches.append(batch)
        return batch.action.sum(1)


def test_the_reward_sees_the_action_that_the_environment_saw() -> None:
    seen: RewardFn = Seen()
    env = RewardWrapper(gym.make("PointMass-v0"), seen)
    env.reset(seed=0)
    reward = env.step(np.array([5.0, -0.5], np.float32))[1]
    assert reward == 0.5
    assert isinstance(seen, Seen)
    assert seen.batches[0].action.tolist() == [[1.0, -0.5]]


def test_each_step_goes_from_the_last_observation_to_the_next_also_after_a_reset() -> None:
    seen = Seen()
    env = RewardWrapper(gym.make("Cliff-v0"), seen)
    for seed in (1, 2):
        obs, _ = env.reset(seed=seed)
        for _ in range(3):
            after = env.step(np.zeros(2, np.float32))[0]
            batch = seen.batches[-1]
            np.testing.assert_allclose(batch.obs[0], obs, rtol=1e-6)
            np.testing.assert_allclose(batch.next_obs[0], after, rtol=1e-6)
            obs = after


def test_a_reset_inside_a_step_is_no_transition() -> None:
    seen = Seen()
    env = RewardWrapper(gym.wrappers.Autoreset(gym.make("PointMass-v0")), seen)
    env.reset(seed=0)
    action = np.array([1.0, 0.5], np.float32)
    assert [env.step(action)[1] for _ in range(pointmass.STEPS)] == [1.5] * pointmass.STEPS
    obs, reward, _, truncated, info = env.step(action)
    assert (reward, truncated, info["own_reward"]) == (0.0, False, 0.0)
    assert len(seen.batches) == pointmass.STEPS
    # the next episode begins at what the reset gave
    assert env.step(action)[1] == 1.5
    np.testing.assert_allclose(seen.batches[-1].obs[0], obs, rtol=1e-6)


def test_two_wrappers_pay_the_outer_reward_and_keep_the_environments_own() -> None:
    env = RewardWrapper(
        RewardWrapper(gym.make("PointMass-v0"), Seen()), lambda batch: 7 + 0 * batch.obs[:, 0]
    )
    env.reset(seed=0)
    _, reward, _, _, info = env.step(np.ones(2, np.float32))
    assert reward == 7.0
    assert info["own_reward"] < 0


class Bare(pointmass.PointMass):
    """The same without Gymnasium's own order check."""


def test_a_step_before_the_first_reset_is_refused() -> None:
    env = Bare()
    env.reset(seed=0)
    with pytest.raises(gym.error.ResetNeeded, match="before its first step"):
        RewardWrapper(env, Seen()).step(np.zeros(2, np.float32))


def test_what_a_batch_cannot_hold_is_refused() -> None:
    env = Bare()
    env.action_space = gym.spaces.MultiDiscrete([2, 3])
    with pytest.raises(ValueError, match="actions of a flat Box, the environment has MultiDiscrete"):
        RewardWrapper(env, Seen())
