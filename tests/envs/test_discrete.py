"""Choices as rows, and observations in a dictionary as one."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Dict, Discrete

from irl.core.errors import UserError
from irl.envs.discrete import OneHot
from irl.envs.flatten import FlatKeys
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollout


def test_rows_and_choices() -> None:
    space = OneHot(Discrete(3, start=5))
    rows = space.rows(np.array([7, 5]))
    np.testing.assert_array_equal(rows, [[0, 0, 1], [1, 0, 0]])
    np.testing.assert_array_equal(space.chosen(rows), [7, 5])
    np.testing.assert_array_equal(space.row(np.array([0.1, 3.0, -2.0])), [0, 1, 0])
    np.testing.assert_array_equal(space.row(np.asarray(6.0)), [0, 1, 0])
    for wrong in (6.7, -0.5, np.nan, np.inf):
        with pytest.raises(ValueError, match=f"a whole number, .* 3 numbers; the policy gave {wrong}"):
            space.row(np.asarray(wrong))
    for wrong in (4, 8):
        with pytest.raises(ValueError, match=f"the action {wrong} at step 1 is none of 5 to 7"):
            space.rows(np.array([5, wrong]))
    assert np.isnan(space.row(np.array([np.nan, 0.0, 0.0]))).any()


def test_an_episode_of_choices() -> None:
    env = make("CartPole-v1")
    by_number = rollout(env, lambda obs: np.asarray(int(obs[2] > 0)), 3)
    by_row = rollout(env, lambda obs: np.eye(2)[int(obs[2] > 0)], 3)
    np.testing.assert_array_equal(by_number.obs, by_row.obs)
    np.testing.assert_array_equal(by_number.action, np.eye(2)[(by_row.obs[:-1, 2] > 0).astype(int)])
    act = random_act(env.action_space, np.random.default_rng(0))
    drawn = np.array([act(by_row.obs[0]) for _ in range(400)])
    assert set(map(tuple, drawn.tolist())) == {(1.0, 0.0), (0.0, 1.0)}
    assert 150 < drawn[:, 0].sum() < 250
    env.close()


class Parts(gym.Env):
    """Observations in a dictionary."""

    observation_space = Dict(
        {"goal": Box(-2.0, 2.0, (2,)), "place": Box(-1.0, 1.0, (2, 2), np.float64), "mode": Discrete(3)}
    )
    action_space = Box(-1.0, 1.0, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._obs(), {}

    def step(self, action):
        return self._obs(), 0.0, False, False, {}

    def _obs(self):
        return {"goal": np.ones(2, np.float32), "place": np.arange(4.0).reshape(2, 2) / 4, "mode": 1}


def test_parts_in_the_order_they_are_named() -> None:
    env = FlatKeys(Parts(), "Parts-v0", ("place", "goal"))
    obs, _ = env.reset(seed=0)
    np.testing.assert_array_equal(obs, [0, 0.25, 0.5, 0.75, 1, 1])
    assert env.observation_space.contains(obs)
    assert isinstance(env.observation_space, Box)
    np.testing.assert_array_equal(env.observation_space.high, [1, 1, 1, 1, 2, 2])
    for keys, said in ((("mode",), "no real numbers 'mode'.* place"), (("goal", "goal"), "twice")):
        with pytest.raises(UserError, match=said):
            FlatKeys(Parts(), "Parts-v0", keys)


def test_a_dictionary_is_flattened_where_its_parts_are_named(monkeypatch) -> None:
    spec = EnvSpec("Parts-v0", lambda **_: Parts(), max_episode_steps=5, disable_env_checker=True)
    monkeypatch.setitem(gym.registry, "Parts-v0", spec)
    with pytest.raises(UserError, match=r'--env-kwargs .\{"obs_keys"'):
        make("Parts-v0")
    env = make('Parts-v0?{"obs_keys": ["goal"]}')
    assert env.observation_space.shape == (2,)
    assert make('Parts-v0?{"obs_keys": "goal"}').observation_space == env.observation_space
    for wrong in ("3", "true", "[]", '[["goal"]]', "{}", "[1]"):
        with pytest.raises(UserError, match=r'obs_keys is .*; expected names of the parts.*"obs_keys"'):
            make(f'Parts-v0?{{"obs_keys": {wrong}}}')
    with pytest.raises(UserError, match="obs_keys is for those in a Dict"):
        make('Pendulum-v1?{"obs_keys": ["goal"]}')
