"""A learned reward in a Stable-Baselines3 program: the twin of the Gymnasium wrapper."""

import sys
from subprocess import run

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv

import irl
from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions, concatenate
from irl.learners.reward_vec import RewardVecWrapper
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.wrapper import RewardWrapper
from tests import pointmass

SEEDS = (3, 5, 8)


class Seen:
    """Pays what the next state is, and keeps what it was asked about."""

    def __init__(self) -> None:
        self.batches: list[Transitions] = []

    def __call__(self, batch: Transitions) -> torch.Tensor:
        self.batches.append(batch)
        return batch.next_obs.sum(1)


def vector(env_id: str, reward, seeds=SEEDS) -> RewardVecWrapper:
    venv = RewardVecWrapper(DummyVecEnv([lambda: gym.make(env_id) for _ in seeds]), reward)
    venv.venv._seeds = list(seeds)
    return venv


def actions(n: int, width: int, size: int = 2) -> list[np.ndarray]:
    rng = np.random.default_rng(0)
    return [rng.uniform(0.2, 1.0, (width, size)).astype(np.float32) for _ in range(n)]


@pytest.mark.parametrize("env_id", ["Cliff-v0", "PointMass-v0"])
def test_it_pays_what_the_gymnasium_wrapper_pays_across_ends(env_id: str) -> None:
    seen, n_steps = Seen(), 70
    venv = vector(env_id, seen)
    first = np.asarray(venv.reset())
    outs = [venv.step(action) for action in actions(n_steps, len(SEEDS))]
    ends = set()
    for i, seed in enumerate(SEEDS):
        env = RewardWrapper(gym.make(env_id), Seen())
        obs, _ = env.reset(seed=seed)
        np.testing.assert_allclose(first[i], obs)
        for action, (after, rewards, dones, infos) in zip(actions(n_steps, len(SEEDS)), outs, strict=True):
            obs, reward, terminated, truncated, info = env.step(action[i])
            assert rewards[i] == pytest.approx(reward, rel=1e-5)
            assert infos[i]["own_reward"] == pytest.approx(info["own_reward"], rel=1e-5)
            assert dones[i] == (terminated or truncated)
            if dones[i]:
                ends.add("fell" if terminated else "cut")
                obs, _ = env.reset()
            np.testing.assert_allclose(np.asarray(after)[i], obs)
    assert ("fell" if env_id == "Cliff-v0" else "cut") in ends


def test_one_call_a_step_with_the_true_next_observation_and_both_kinds_of_end() -> None:
    seen = Seen()
    venv = vector("PointMass-v0", seen)
    venv.reset()
    for action in actions(65, 3):
        venv.step(action)
    assert [len(batch) for batch in seen.batches] == [3] * 65
    batch = concatenate(seen.batches)
    # an episode's last step is no jump to the next start: a step goes 0.06 and its noise
    assert float((batch.next_obs - batch.obs).abs().max()) < 0.15
    assert not batch.terminated.any()
    assert int(batch.truncated.sum()) == 3 * (65 // pointmass.STEPS)


def test_the_learned_reward_adds_the_tail_at_a_fall_and_not_at_a_time_limit() -> None:
    seen = Seen()
    venv = vector("Cliff-v0", seen)
    venv.reset()
    for action in actions(70, 3):
        venv.step(action)
    recorded = concatenate(seen.batches)
    assert recorded.terminated.any()
    shape = LogitSpec(2, 2, (8,), absorbing_scale=10.0)
    spec = RewardSpec("Cliff-v0", "dac", "logit", "obs, action", shape, 0.9, 1.0, 0, {})
    net = LogitNet(shape, fitted_normaliser(recorded.obs), torch_stream(0, "net"))
    reward = LearnedReward(spec, net)
    venv = vector("Cliff-v0", reward)
    venv.reset()
    rewards = np.concatenate([venv.step(action)[1] for action in actions(70, 3)])
    np.testing.assert_allclose(rewards, reward(recorded), rtol=1e-4, atol=1e-5)
    tail = 9 * float(net.of_absorbing())
    np.testing.assert_allclose(
        rewards - reward.logits(recorded).numpy(), tail * recorded.terminated.numpy(), atol=1e-4
    )


def test_ppo_learns_from_it_and_not_from_the_environments_own() -> None:
    # the environment's own reward is NaN: one look at it and no weight is a number
    venv = vector("NaNReward-v0", lambda batch: -batch.next_obs.norm(dim=1))
    model = PPO("MlpPolicy", venv, n_steps=64, batch_size=32, n_epochs=2, seed=0, device="cpu")
    model.learn(128)
    assert all(torch.isfinite(parameter).all() for parameter in model.policy.parameters())


def test_what_a_batch_cannot_hold_is_refused() -> None:
    with pytest.raises(ValueError, match="observations of a flat Box"):
        vector("FrozenLake-v1", Seen())


def test_choices_are_paid_as_rows() -> None:
    venv = vector("CartPole-v1", lambda batch: batch.action[:, 1])
    venv.reset()
    chosen = np.arange(venv.num_envs) % 2
    _, paid, _, _ = venv.step(chosen)
    np.testing.assert_array_equal(paid, chosen)


def test_the_public_name_is_this_class_and_importing_irl_does_not_import_sb3() -> None:
    assert irl.RewardVecWrapper is RewardVecWrapper
    code = "import sys, irl; sys.exit('stable_baselines3' in sys.modules)"
    assert run([sys.executable, "-c", code], check=False).returncode == 0
    with pytest.raises(AttributeError, match="no attribute 'RewardVec'"):
        _ = irl.RewardVec  # pyright: ignore[reportAttributeAccessIssue]
