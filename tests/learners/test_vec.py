"""The recording vector of environments, against the same environments stepped by hand."""

import gymnasium as gym
import numpy as np
import torch

from irl.learners.vec import RecordingVecEnv
from tests import pointmass

SEEDS = [3, 5]


def _played(env_id: str, n_steps: int) -> tuple[RecordingVecEnv, list]:
    venv = RecordingVecEnv(env_id, SEEDS)
    venv.reset()
    rng = np.random.default_rng(0)
    outs = [venv.step(rng.uniform(0.2, 1.0, (2, 2)).astype(np.float32)) for _ in range(n_steps)]
    return venv, outs


def test_steps_are_recorded_time_major_with_the_true_next_observation_and_both_kinds_of_end() -> None:
    n_steps = 60
    venv, _ = _played("Cliff-v0", n_steps)
    batch = venv.take()
    rng = np.random.default_rng(0)
    actions = [rng.uniform(0.2, 1.0, (2, 2)).astype(np.float32) for _ in range(n_steps)]
    kinds = set()
    for i, seed in enumerate(SEEDS):
        env = gym.make("Cliff-v0")
        obs, _ = env.reset(seed=seed)
        for t in range(n_steps):
            after, reward, terminated, truncated, _ = env.step(actions[t][i])
            row = batch[torch.tensor([2 * t + i])]
            np.testing.assert_allclose(row.obs[0], obs, rtol=1e-6)
            np.testing.assert_array_equal(row.action[0], actions[t][i])
            np.testing.assert_allclose(row.next_obs[0], after, rtol=1e-6)
            assert (bool(row.terminated), bool(row.truncated)) == (terminated, truncated and not terminated)
            assert row.reward is not None
            assert abs(float(row.reward) - float(reward)) < 1e-6
            kinds |= {name for name, flag in (("end", terminated), ("cut", truncated)) if flag}
            obs = env.reset()[0] if terminated or truncated else after
    assert "end" in kinds


def test_a_time_limit_is_a_truncation_and_no_termination() -> None:
    venv, _ = _played("PointMass-v0", pointmass.STEPS)
    batch = venv.take()
    assert batch.truncated.tolist() == [False] * (2 * pointmass.STEPS - 2) + [True, True]
    assert not batch.terminated.any()


def test_the_environments_own_reward_is_recorded_and_not_handed_on() -> None:
    venv, outs = _played("PointMass-v0", 5)
    recorded = venv.take().reward
    assert recorded is not None
    assert (recorded < 0).all()
    assert all((rewards == 0).all() for _, rewards, _, _ in outs)


def test_finished_episodes_carry_return_and_length() -> None:
    venv, _ = _played("PointMass-v0", pointmass.STEPS + 3)
    rewards = venv.take().reward
    assert rewards is not None
    finished = venv.take_finished()
    assert [length for _, length in finished] == [pointmass.STEPS] * 2
    expected = rewards.reshape(-1, 2)[: pointmass.STEPS].sum(0)
    np.testing.assert_allclose([value for value, _ in finished], expected, rtol=1e-5)
    assert venv.take_finished() == []


def test_restored_environments_go_on_as_if_nothing_had_happened() -> None:
    venv, _ = _played("Cliff-v0", 25)
    venv.take()
    venv.take_finished()
    state, obs = venv.state_dict(), venv._obs
    other = RecordingVecEnv("Cliff-v0", [11, 12])
    other.reset()
    other.load_state_dict(state)
    other.resume_from(obs)
    rng = np.random.default_rng(1)
    for _ in range(30):
        action = rng.uniform(-1, 1, (2, 2)).astype(np.float32)
        for ours, theirs in zip(venv.step(action)[:3], other.step(action)[:3], strict=True):
            np.testing.assert_array_equal(ours, theirs)
    assert venv.take_finished() == other.take_finished()


def test_hopper_is_restored_to_the_bit() -> None:
    venv = RecordingVecEnv("Hopper-v5", [0])
    venv.reset()
    rng = np.random.default_rng(0)
    for _ in range(37):
        venv.step(rng.uniform(-1, 1, (1, 3)).astype(np.float32))
    other = RecordingVecEnv("Hopper-v5", [9])
    other.reset()
    other.load_state_dict(venv.state_dict())
    for _ in range(60):
        action = rng.uniform(-1, 1, (1, 3)).astype(np.float32)
        ours, theirs = venv.step(action), other.step(action)
        np.testing.assert_array_equal(ours[0], theirs[0])
