"""An episode holds what the environment saw and said."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.spaces import Box

from irl.core.errors import UserError
from irl.core.types import Episode
from irl.envs import rollouts as rollouts_module
from irl.envs.make import make
from irl.envs.names import full_name
from irl.envs.rollouts import random_act, record, rollout, rollouts
from tests import pointmass

NO_TORQUE = np.zeros(3, dtype=np.float32)


def still(obs: np.ndarray) -> np.ndarray:
    return NO_TORQUE


def assert_same(a: Episode, b: Episode) -> None:
    columns = [({"obs": e.obs, "action": e.action, "reward": e.reward, **e.terms, **e.infos}) for e in (a, b)]
    assert columns[0].keys() == columns[1].keys()
    for name, values in columns[0].items():
        np.testing.assert_array_equal(values, columns[1][name], err_msg=name)


def test_an_episode_is_what_a_plain_loop_sees():
    env = make("Hopper-v5")
    episode, at_reset = record(env, still, seed=3)
    obs, info = env.reset(seed=3)
    terminated = truncated = False
    assert at_reset["x_position"] == info["x_position"]
    for step in range(len(episode)):
        np.testing.assert_array_equal(episode.obs[step], obs)
        obs, reward, terminated, truncated, info = env.step(NO_TORQUE)
        assert episode.reward[step] == reward
        assert episode.infos["x_position"][step] == info["x_position"]
        assert episode.terms["forward"][step] == info["reward_forward"]
    np.testing.assert_array_equal(episode.obs[-1], obs)
    assert (episode.terminated, episode.truncated) == (terminated, truncated) == (True, False)
    assert episode.seed == 3
    assert episode.obs.dtype == episode.reward.dtype == np.float64
    env.close()


def test_a_time_limit_is_recorded_as_one_and_not_as_a_termination():
    (episode,) = pointmass.demonstrations(1)
    assert (len(episode), episode.terminated, episode.truncated) == (pointmass.STEPS, False, True)


def test_an_episode_that_never_ends_is_refused_and_one_with_a_limit_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rollouts_module, "MOST", 50)
    act = pointmass.expert()
    with pytest.raises(UserError, match=r"PointMass .*50 steps; .*--env-kwargs max_episode_steps=1000"):
        rollout(pointmass.PointMass(), act, seed=0)
    for limit in (20, 80):
        given = full_name("PointMass-v0", (f"max_episode_steps={limit}",))
        assert [len(episode) for episode in rollouts(given, act, [0])] == [limit]


def test_actions_are_clipped_to_the_bounds():
    def too_strong(obs: np.ndarray) -> np.ndarray:
        return np.array([5.0, -5.0, 0.1])

    env = make("Hopper-v5")
    episode = rollout(env, too_strong, seed=0)
    env.close()
    np.testing.assert_array_equal(episode.action[0], np.array([1.0, -1.0, 0.1], dtype=np.float32))


def test_same_seeds_same_episodes_and_each_is_announced():
    heard: list[Episode] = []
    first = rollouts("InvertedPendulum-v5", lambda obs: 0.3 * obs[:1], [5, 6], heard.append)
    again = rollouts("InvertedPendulum-v5", lambda obs: 0.3 * obs[:1], [6])
    assert [e.seed for e in first] == [5, 6]
    assert all(a is b for a, b in zip(first, heard, strict=True))
    assert_same(first[1], again[0])


def test_random_actions_fill_the_bounds_and_follow_the_generator():
    space = Box(np.array([-1, 0], np.float32), np.array([1, 5], np.float32))
    act = random_act(space, np.random.default_rng(0))
    drawn = np.array([act(np.zeros(1)) for _ in range(2000)])
    np.testing.assert_allclose(drawn.mean(0), [0, 2.5], atol=0.15)
    assert all(space.contains(row.astype(np.float32)) for row in drawn)
    same = random_act(space, np.random.default_rng(0))
    np.testing.assert_array_equal(same(np.zeros(1)), drawn[0])
    with pytest.raises(ValueError, match="bounded Box"):
        random_act(gym.spaces.Discrete(2), np.random.default_rng(0))


@pytest.mark.parametrize(
    ("action", "message"),
    [(np.zeros(2), r"expected actions of shape \(3,\)"), (np.full(3, np.nan), "at step 0")],
)
def test_actions_that_cannot_be(action: np.ndarray, message: str):
    env = _Buffered()
    env.action_space = Box(-1, 1, (3,))
    with pytest.raises(ValueError, match=message):
        rollout(env, lambda obs: action, seed=0)


class _Buffered(gym.Env):
    """Counts to 3, in one buffer and one info that it uses again and again."""

    observation_space = Box(0, 10, (1,))
    action_space = Box(-1, 1, (1,))

    def reset(self, *, seed=None, options=None):
        self.obs, self.info = np.zeros(1, np.float32), {"count": 0, "name": "a", "pair": np.zeros(2)}
        return self.obs, self.info

    def step(self, action):
        self.obs += 1
        self.info["count"] += 1
        if self.obs[0] == 2:
            self.info["odd_one"] = 1.0
        return self.obs, 1.0, False, bool(self.obs[0] == 3), self.info


def test_an_unknown_environment_keeps_the_numbers_that_every_step_has():
    episode, at_reset = record(_Buffered(), lambda obs: np.zeros(1), seed=0)
    np.testing.assert_array_equal(episode.obs[:, 0], [0, 1, 2, 3])
    assert {key: list(values) for key, values in episode.infos.items()} == {"count": [1, 2, 3]}
    assert episode.terms == {}
    assert (episode.terminated, episode.truncated) == (False, True)
    assert at_reset.keys() == {"count"}


def test_a_choice_of_actions_is_refused_with_what_makes_rows_of_it():
    env = gym.make("CartPole-v1")
    with pytest.raises(ValueError, match=r"a Box, not Discrete\(2\); irl\.envs\.make\.make"):
        rollout(env, lambda obs: np.asarray(1), seed=0)
    env.close()
