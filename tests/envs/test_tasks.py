"""Each row of the table against the live environment."""

import numpy as np
import pytest

from irl.envs.make import make
from irl.envs.rollouts import random_act, record
from irl.envs.tasks import TASKS, Task, task_name, task_of


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_terms_add_up_to_the_reward_and_the_infos_exist(task: Task):
    env = make(task.env_id)
    episodes = [
        record(env, random_act(env.action_space, np.random.default_rng(seed)), seed)[0] for seed in (0, 1)
    ]
    env.close()
    for episode in episodes:
        assert set(episode.terms) == {*task.terms.values(), *task.constants}
        assert set(episode.infos) == set(task.infos)
        total = np.sum(list(episode.terms.values()), axis=0)
        np.testing.assert_allclose(total, episode.reward, rtol=0, atol=1e-12)


def test_costs_are_negative():
    env = make("HalfCheetah-v5")
    episode, _ = record(env, random_act(env.action_space, np.random.default_rng(0)), 0)
    env.close()
    # control_cost_weight of HalfCheetah is 0.1
    np.testing.assert_allclose(episode.terms["ctrl"], -0.1 * np.sum(episode.action**2, axis=1), rtol=1e-6)


def test_names_are_unique():
    assert len({task.env_id for task in TASKS}) == len({task.name for task in TASKS}) == len(TASKS)


def test_task_of_wants_the_version():
    row = task_of("Hopper-v5")
    assert row is not None
    assert row.terms == {"reward_forward": "forward", "reward_ctrl": "ctrl", "reward_survive": "survive"}
    assert task_of("Hopper-v4") is None


@pytest.mark.parametrize(
    ("env_id", "name"),
    [
        ("Hopper-v5", "hopper"),
        ("InvertedDoublePendulum-v5", "inverteddoublependulum"),
        ("Pendulum-v1", "pendulum"),
        ("my_module:Some.Robot-v12", "my_module-some-robot"),
        ("ALE/Pong-v5", "ale-pong"),
    ],
)
def test_task_name(env_id: str, name: str):
    assert task_name(env_id) == name
