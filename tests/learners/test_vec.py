"""The recording vector of environments, against the same environments stepped by hand."""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch

from irl.core import state
from irl.core.errors import UserError
from irl.core.log import Logs
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.learners.td3 import TD3Config, TD3Learner
from irl.learners.vec import RecordingVecEnv
from irl.rewards.mujoco import HandWritten
from tests import pointmass

SEEDS = [3, 5]


class OwnDraws(pointmass.PointMass):
    """Its starts are drawn from a generator of its own, as in much code of before Gymnasium."""

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        super().reset(seed=seed)
        self.rng = np.random.default_rng(seed)
        self._x = self.rng.uniform(-0.9, 0.9, 2)
        return self._x.copy(), {}


if "OwnDraws-v0" not in gym.registry:
    gym.register(
        "OwnDraws-v0", lambda **_: OwnDraws(), max_episode_steps=pointmass.STEPS, disable_env_checker=True
    )


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
    place, obs = venv.state_dict(), venv.obs
    other = RecordingVecEnv("Cliff-v0", [11, 12])
    other.reset()
    other.load_state_dict(place, obs)
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
    other.load_state_dict(venv.state_dict(), venv.obs)
    for _ in range(60):
        action = rng.uniform(-1, 1, (1, 3)).astype(np.float32)
        ours, theirs = venv.step(action), other.step(action)
        np.testing.assert_array_equal(ours[0], theirs[0])


def test_a_task_that_draws_from_a_generator_of_its_own_does_not_go_on() -> None:
    first, _ = _played("OwnDraws-v0", pointmass.STEPS - 1)
    other = RecordingVecEnv("OwnDraws-v0", [11, 12])
    other.reset()
    # the first episode has a seed, and is found again
    other.load_state_dict(first.state_dict(), first.obs)
    later, _ = _played("OwnDraws-v0", pointmass.STEPS + 5)
    with pytest.raises(UserError, match=r"OwnDraws-v0 was replayed.* a generator other than its np_random"):
        other.load_state_dict(later.state_dict(), later.obs)


def test_a_replay_that_another_processor_rounds_goes_on() -> None:
    venv, _ = _played("Cliff-v0", 25)
    other = RecordingVecEnv("Cliff-v0", SEEDS)
    other.reset()
    other.load_state_dict(venv.state_dict(), elsewhere := venv.obs + 0.1)
    np.testing.assert_array_equal(other.obs, elsewhere)
    action = np.zeros((2, 2), np.float32)
    np.testing.assert_array_equal(other.step(action)[0], venv.step(action)[0])


def _learner(kind: str) -> PPOLearner | SACLearner | TD3Learner:
    shared: dict[str, Any] = {"seed": 0, "total_steps": 600}
    small: dict[str, Any] = {"steps_per_round": 100, "learning_starts": 150, "batch_size": 16}
    small |= {"hidden": (8,), "buffer_size": 200}
    if kind == "ppo":
        ppo = PPOConfig(n_envs=2, steps_per_round=80, batch_size=40, n_epochs=1, hidden=(8,))
        return PPOLearner("OwnDraws-v0", SEEDS, ppo, normaliser=None, **shared)
    if kind == "sac":
        return SACLearner("OwnDraws-v0", SEEDS[:1], SACConfig(**small), **shared)
    return TD3Learner("OwnDraws-v0", SEEDS[:1], TD3Config(**small), **shared)


@pytest.mark.parametrize("kind", ["ppo", "sac", "td3"])
def test_no_learner_goes_on_in_such_a_task(kind: str, tmp_path: Path) -> None:
    learner = _learner(kind)
    learner.start(HandWritten())
    learner.collect()
    state.save(tmp_path, learner.state_dict(), Logs(tmp_path / "logs"))
    with pytest.raises(UserError, match="np_random"):
        _learner(kind).load_state_dict(state.load(tmp_path, Logs(tmp_path / "logs")))
