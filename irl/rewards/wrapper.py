"""A reward in any Gymnasium program: the environment as it was, paid by a `RewardFn`.

>>> import gymnasium, irl
>>> env = irl.RewardWrapper(gymnasium.make("Hopper-v5"), irl.load_reward("runs/hopper"))  # doctest: +SKIP
"""

from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.spaces import Box, Discrete

from irl.core.types import RewardFn, Transitions
from irl.envs.discrete import OneHot

OWN_REWARD = "own_reward"
"""Where the environment's own reward goes in `info`."""


class RewardWrapper(gym.Wrapper):
    """Pays each step by `reward` of that one transition; the environment's own is in `info["own_reward"]`.

    It sees what the environment gives: put wrappers that change observations or actions outside it, and
    give it the observations that the reward was learned on. A step after an episode's end is a reset
    (`gymnasium.wrappers.Autoreset`) and no transition: it pays 0.

    Raises:
        ValueError: observations are no flat box, or actions neither that nor a choice.
    """

    def __init__(self, env: gym.Env, reward: RewardFn) -> None:
        check_spaces(env.observation_space, env.action_space)
        super().__init__(env)
        self.reward_fn = reward
        self._obs: np.ndarray | None = None
        self._over = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict]:
        """Start an episode."""
        obs, info = self.env.reset(seed=seed, options=options)
        self._obs, self._over = np.array(obs, dtype=np.float32), False
        return obs, info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict]:
        """One step, its reward replaced.

        Raises:
            ResetNeeded: there is no episode to step in.
        """
        obs, own, terminated, truncated, info = self.env.step(action)
        if self._obs is None:
            raise gym.error.ResetNeeded("reset the environment before its first step")
        assert isinstance(self.action_space, Box | Discrete)
        before, after, resets = self._obs, np.array(obs, dtype=np.float32), self._over
        self._obs, self._over = after, bool(terminated or truncated)
        info = {OWN_REWARD: own} | info
        if resets:
            return obs, 0.0, terminated, truncated, info
        batch = one_step(
            before[None],
            np.asarray(action)[None],
            after[None],
            np.array([terminated]),
            np.array([truncated]),
            self.action_space,
        )
        return obs, float(pay(self.reward_fn, batch)[0]), terminated, truncated, info


def check_spaces(observation: gym.Space, action: gym.Space) -> None:
    """Refuse spaces that `Transitions` cannot hold.

    Raises:
        ValueError: one is no flat box, nor a choice of actions; it is named.
    """
    rows = OneHot(action) if isinstance(action, Discrete) else action
    for name, space in (("observations", observation), ("actions", rows)):
        if not isinstance(space, Box) or len(space.shape) != 1:
            raise ValueError(f"a reward reads {name} of a flat Box, the environment has {space}")


def one_step(
    obs: np.ndarray,
    action: np.ndarray,
    next_obs: np.ndarray,
    terminated: np.ndarray,
    truncated: np.ndarray,
    space: Box | Discrete,
) -> Transitions:
    """One step of N environments, actions clipped to the bounds: what the environment saw.

    Choices become rows.
    """
    if isinstance(space, Discrete):
        clipped = OneHot(space).rows(action)
    else:
        clipped = np.clip(action, space.low, space.high)
    return Transitions(
        torch.as_tensor(obs, dtype=torch.float32),
        torch.as_tensor(clipped, dtype=torch.float32),
        torch.as_tensor(next_obs, dtype=torch.float32),
        torch.as_tensor(terminated, dtype=torch.bool),
        torch.as_tensor(truncated, dtype=torch.bool),
    )


def pay(reward: RewardFn, batch: Transitions) -> np.ndarray:
    """The reward of each step, float32, without a gradient."""
    with torch.no_grad():
        return reward(batch).float().cpu().numpy()
