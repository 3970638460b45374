"""A vector of environments that keeps what the learner's library drops.

SB3 resets an environment inside `step` and hands out the first observation of the next episode; the
true next observation, and whether the task or the clock ended the episode, are in `infos` for that
one step only. This wrapper writes them down, and hands on zeros for the environment's own reward, so
that no code path of a learner can come to depend on it.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Discrete
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecEnvWrapper

from irl.core.types import Transitions
from irl.envs.discrete import OneHot
from irl.envs.make import make
from irl.envs.replayable import Replayable


class Envs(DummyVecEnv):
    """SB3's vector without its deep copy of every `info`, a quarter of the time of a Hopper step."""

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict]]:
        """One step of each environment; one that ended is reset."""
        infos = []
        for i, env in enumerate(self.envs):
            obs, self.buf_rews[i], terminated, truncated, given = env.step(self.actions[i])
            info = {**given, "TimeLimit.truncated": truncated and not terminated}
            self.buf_dones[i] = terminated or truncated
            if self.buf_dones[i]:
                info["terminal_observation"] = obs
                obs, self.reset_infos[i] = env.reset()
            self._save_obs(i, obs)
            infos.append(info)
        obs = self._obs_from_buf()
        assert isinstance(obs, np.ndarray)
        return obs, self.buf_rews.copy(), self.buf_dones.copy(), infos


class Recorder(VecEnvWrapper):
    """Steps a vector of environments and records each step until `take` is called."""

    def __init__(self, inner: VecEnv) -> None:
        self._rows = inner.action_space if isinstance(inner.action_space, OneHot) else None
        # SB3 knows choices from 0 on
        choices = Discrete(len(self._rows.low)) if self._rows is not None else None
        super().__init__(inner, action_space=choices)
        self._steps: list[tuple[np.ndarray, ...]] = []
        self._returns, self._lengths = np.zeros(inner.num_envs), np.zeros(inner.num_envs, dtype=np.int64)
        self.finished: list[tuple[float, int]] = []
        """Return and length of each episode that ended since the last `take_finished`."""

    def reset(self) -> np.ndarray:
        """Reset every environment."""
        self._obs = _flat(self.venv.reset())
        return self._obs

    def step_async(self, actions: np.ndarray) -> None:
        """Hand over the actions; the caller has clipped them to the bounds. Choices become rows here."""
        if self._rows is not None:
            actions = np.eye(len(self._rows.low), dtype=np.float32)[np.asarray(actions)]
        self._actions = np.array(actions, copy=True)
        self.venv.step_async(actions)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict]]:
        """The observations that follow, zeros for rewards, ends, infos."""
        given, rewards, dones, infos = self.venv.step_wait()
        obs = _flat(given)
        next_obs, truncated = obs.copy(), np.zeros(len(dones), dtype=bool)
        for info, reward in zip(infos, rewards, strict=True):
            info["own_reward"] = reward
        for i in np.flatnonzero(dones).tolist():
            next_obs[i] = infos[i]["terminal_observation"]
            truncated[i] = infos[i].get("TimeLimit.truncated", False)
        terminated = dones & ~truncated
        self._steps.append((self._obs, self._actions, next_obs, terminated, truncated, rewards.copy()))
        self._count(rewards, dones)
        self._obs = obs
        return obs, np.zeros_like(rewards), dones, infos

    @property
    def obs(self) -> np.ndarray:
        """What the next action answers to: after an episode's end, the first of the next one."""
        return self._obs

    @property
    def last_step(self) -> tuple[np.ndarray, ...]:
        """obs, action, the true next obs, terminated, truncated and own reward of the newest step."""
        return self._steps[-1]

    def take(self) -> Transitions:
        """Every step since the last call, time-major: row t * N + i is step t of environment i."""
        columns = [np.stack(column) for column in zip(*self._steps, strict=True)]
        self._steps = []
        obs, action, next_obs, terminated, truncated, reward = (
            torch.from_numpy(c.reshape(-1, *c.shape[2:])) for c in columns
        )
        return Transitions(
            obs.float(), action.float(), next_obs.float(), terminated, truncated, reward.double()
        )

    def take_finished(self) -> list[tuple[float, int]]:
        """Return and length of each episode that ended since the last call."""
        finished, self.finished = self.finished, []
        return finished

    def _count(self, rewards: np.ndarray, dones: np.ndarray) -> None:
        self._returns += rewards
        self._lengths += 1
        self.finished += [(float(self._returns[i]), int(self._lengths[i])) for i in np.flatnonzero(dones)]
        self._returns[dones], self._lengths[dones] = 0.0, 0


class RecordingVecEnv(Recorder):
    """The same of environments that it makes, whose place can be saved."""

    def __init__(self, env_id: str, seeds: Sequence[int], env_kwargs: dict[str, Any] | None = None) -> None:
        def builder() -> Replayable:
            return Replayable(make(env_id, **(env_kwargs or {})))

        super().__init__(Envs([builder for _ in seeds]))
        self._first_seeds = list(seeds)

    def reset(self) -> np.ndarray:
        """Reset every environment with its own seed."""
        self.venv._seeds = list(self._first_seeds)
        return super().reset()

    def state_dict(self) -> dict[str, Any]:
        """Where every environment is; read between two rollouts, when nothing is recorded."""
        positions = [env.position() for env in self._envs()]
        return {"positions": positions, "returns": self._returns.copy(), "lengths": self._lengths.copy()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Bring the environments there by replaying their last episode so far."""
        for env, position in zip(self._envs(), state["positions"], strict=True):
            env.restore(position)
        self._returns, self._lengths = state["returns"].copy(), state["lengths"].copy()

    def resume_from(self, obs: np.ndarray) -> None:
        """Say what the observations were, after `load_state_dict`: replaying does not return them."""
        self._obs = obs

    def _envs(self) -> list[Replayable]:
        inner = self.venv
        assert isinstance(inner, DummyVecEnv)
        return inner.envs  # pyright: ignore[reportReturnType]


def _flat(obs: Any) -> np.ndarray:
    # `make` admits Box observations only, SB3's types do not know that
    assert isinstance(obs, np.ndarray)
    return obs
