"""Tasks stepped together are to the bit the same as Gymnasium's own, one by one."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from irl.core.errors import UserError
from irl.envs.make import make
from irl.envs.planar import Planar, can_step
from irl.envs.replayable import Replayable
from irl.envs.tasks import TASKS

STEPS, N = 200, 3
CASES: list[tuple[str, dict[str, Any]]] = [
    ("Hopper-v5", {}),
    ("Hopper-v5", {"terminate_when_unhealthy": False, "healthy_reward": 0.3, "max_episode_steps": 60}),
    ("Hopper-v5", {"healthy_state_range": (-2.0, 2.0), "exclude_current_positions_from_observation": False}),
    ("Walker2d-v5", {"ctrl_cost_weight": 0.5, "frame_skip": 3}),
    ("HalfCheetah-v5", {"forward_reward_weight": 2.0, "max_episode_steps": 70}),
]


def copies(env_id: str, n: int = N, **kwargs: Any) -> list[Replayable]:
    envs = [Replayable(make(env_id, **kwargs)) for _ in range(n)]
    for seed, env in enumerate(envs):
        env.reset(seed=seed)
    return envs


def drawn(env: gym.Env, rng: np.random.Generator, n: int = N) -> np.ndarray:
    assert isinstance(env.action_space, gym.spaces.Box)
    return rng.uniform(env.action_space.low, env.action_space.high, (n, *env.action_space.shape)).astype(
        np.float32
    )


@pytest.mark.parametrize(("env_id", "kwargs"), CASES)
def test_every_observation_reward_and_end_is_that_of_the_wrapped_task(
    env_id: str, kwargs: dict[str, Any]
) -> None:
    together = copies(env_id, **kwargs)
    alone = [gym.make(env_id, **kwargs) for _ in range(N)]
    for seed, env in enumerate(alone):
        env.reset(seed=seed)
    planar, rng, ended = Planar(together), np.random.default_rng(0), 0
    for _ in range(STEPS):
        actions = drawn(alone[0], rng)
        obs, reward, terminated, truncated = planar.step(actions)
        for i, env in enumerate(alone):
            its = env.step(actions[i])
            np.testing.assert_array_equal(obs[i], its[0])
            assert (reward[i], terminated[i], truncated[i]) == its[1:4]
            if terminated[i] or truncated[i]:
                ended += 1
                np.testing.assert_array_equal(together[i].reset()[0], env.reset()[0])
    assert ended >= 3


def test_a_position_after_such_steps_is_restored_by_ordinary_ones_to_the_bit() -> None:
    there, rng = copies("Hopper-v5", 1), np.random.default_rng(1)
    planar, again = Planar(there), copies("Hopper-v5", 1)
    for _ in range(10):
        planar.step(drawn(there[0], rng, 1) * 0.1)
    again[0].restore(there[0].position())
    both = planar, Planar(again)
    for _ in range(30):
        actions = drawn(there[0], rng, 1) * 0.1
        steps = [of.step(actions) for of in both]
        for mine, its in zip(*steps, strict=True):
            np.testing.assert_array_equal(mine, its)


def test_an_observation_that_is_not_finite_is_refused_in_the_words_of_the_guard() -> None:
    envs = copies("HalfCheetah-v5")
    planar = Planar(envs)
    planar.step(np.zeros((N, 6), dtype=np.float32))
    planar._qpos = planar._qpos.view(_Spoiled)
    with pytest.raises(UserError, match=r"HalfCheetah-v5 gave .* nan in column 7 after step 1 \(seed 1\)"):
        planar.step(np.zeros((N, 6), dtype=np.float32))


class _Spoiled(np.ndarray):
    """Copy 1 has NaN at joint 8 whatever is written."""

    def __setitem__(self, key: Any, value: Any) -> None:
        value = np.array(value)
        value[8] = np.nan if key == 1 else value[8]
        super().__setitem__(key, value)


def test_only_tasks_whose_every_wrapper_is_known_are_stepped_together() -> None:
    known = {task.env_id for task in TASKS if can_step(copies(task.env_id, 1))}
    assert known == {"Hopper-v5", "Walker2d-v5", "HalfCheetah-v5"}
    assert not can_step([make("Hopper-v5")])
    assert not can_step([Replayable(gym.wrappers.ClipReward(make("Hopper-v5"), 0.0))])
