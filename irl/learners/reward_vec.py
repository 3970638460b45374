"""A reward in any Stable-Baselines3 program: a vector of environments paid by a `RewardFn`.

>>> from stable_baselines3.common.env_util import make_vec_env
>>> import irl
>>> venv = make_vec_env("Hopper-v5", n_envs=4)                                  # doctest: +SKIP
>>> venv = irl.RewardVecWrapper(venv, irl.load_reward("runs/hopper"))           # doctest: +SKIP
"""

import numpy as np
from gymnasium.spaces import Box, Discrete
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from irl.core.types import RewardFn
from irl.rewards.wrapper import OWN_REWARD, check_spaces, one_step, pay


class RewardVecWrapper(VecEnvWrapper):
    """Pays each step by `reward`, one call for all environments; their own is in `info["own_reward"]`.

    The next observation of an episode's last step is the true one, not the reset's. A time limit is no
    termination. `VecNormalize` and the like go outside: the reward is of raw observations. A `Monitor`
    inside goes on to count the environment's own reward.

    Raises:
        ValueError: observations are no flat box, or actions neither that nor a choice.
    """

    def __init__(self, venv: VecEnv, reward: RewardFn) -> None:
        check_spaces(venv.observation_space, venv.action_space)
        super().__init__(venv)
        self.reward_fn = reward

    def reset(self) -> np.ndarray:
        """Start an episode in every environment."""
        self._obs = _flat(self.venv.reset())
        return self._obs

    def step_async(self, actions: np.ndarray) -> None:
        """Hand over the actions."""
        self._actions = np.array(actions, copy=True)
        self.venv.step_async(actions)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict]]:
        """The observations that follow, the reward, ends, infos."""
        given, own, dones, infos = self.venv.step_wait()
        obs = _flat(given)
        next_obs, truncated = obs.copy(), np.zeros(len(dones), dtype=bool)
        for i in np.flatnonzero(dones).tolist():
            next_obs[i] = infos[i]["terminal_observation"]
            truncated[i] = infos[i].get("TimeLimit.truncated", False)
        assert isinstance(self.action_space, Box | Discrete)
        batch = one_step(self._obs, self._actions, next_obs, dones & ~truncated, truncated, self.action_space)
        self._obs = obs
        paid = [{OWN_REWARD: reward} | info for info, reward in zip(infos, own, strict=True)]
        return obs, pay(self.reward_fn, batch), dones, paid


def _flat(obs: object) -> np.ndarray:
    # the spaces were checked, SB3's types do not know that
    assert isinstance(obs, np.ndarray)
    return obs
