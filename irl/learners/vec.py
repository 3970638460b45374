"""A vector of environments that keeps what the learner's library drops.

SB3 resets an environment inside `step` and hands out the first observation of the next episode; the
true next observation, and whether the task or the clock ended the episode, are in `infos` for that
one step only. This wrapper writes them down, and hands on zeros for the environment's own reward, so
that no code path of a learner can come to depend on it.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import torch
from gymnasium.spaces import Discrete
from jaxtyping import Bool, Float
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecEnvWrapper

from irl.core.types import Transitions
from irl.envs.discrete import OneHot
from irl.envs.make import make
from irl.envs.planar import Planar, can_step
from irl.envs.replayable import Replayable


class Step(NamedTuple):
    """One step of every environment."""

    obs: Float[np.ndarray, "N O"]
    """What the next action answers to: after an episode's end, the first of the next one."""
    next_obs: Float[np.ndarray, "N O"]
    """What followed, an episode's last one included."""
    reward: Float[np.ndarray, "N"]
    terminated: Bool[np.ndarray, "N"]
    truncated: Bool[np.ndarray, "N"]


class Envs(DummyVecEnv):
    """SB3's vector without its deep copy of every `info`, a quarter of the time of a Hopper step."""

    def __init__(self, builders: list[Callable[[], gym.Env]]) -> None:
        super().__init__(builders)
        self._planar = Planar(self.envs) if can_step(self.envs) else None  # pyright: ignore[reportArgumentType]

    def advance(self, actions: np.ndarray) -> Step:
        """One step of each environment without its `info`; one that ended is reset."""
        step = self._planar.step(actions) if self._planar else self._by_hand(actions)
        next_obs, reward, terminated, truncated = step
        obs, ends = next_obs, np.flatnonzero(terminated | truncated).tolist()
        if ends:
            obs = next_obs.copy()
            for i in ends:
                obs[i], self.reset_infos[i] = self.envs[i].reset()
        return Step(obs, next_obs, reward.astype(np.float32, copy=False), terminated, truncated & ~terminated)

    def _by_hand(self, actions: np.ndarray) -> tuple[np.ndarray, ...]:
        steps = [env.step(action)[:4] for env, action in zip(self.envs, actions, strict=True)]
        obs, reward, *ends = zip(*steps, strict=True)
        rows = np.array(obs, dtype=self.observation_space.dtype)
        return rows, np.array(reward, dtype=np.float32), *(np.array(end, dtype=bool) for end in ends)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict]]:
        """The same for SB3, with as much of `info` as it asks for."""
        step = self.advance(self.actions)
        dones = step.terminated | step.truncated
        infos: list[dict] = [{"TimeLimit.truncated": bool(cut)} for cut in step.truncated]
        for i in np.flatnonzero(dones).tolist():
            infos[i]["terminal_observation"] = step.next_obs[i]
        return step.obs, step.reward, dones, infos


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
        self._record(Step(obs, next_obs, rewards.copy(), dones & ~truncated, truncated), dones)
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

    def _record(self, step: Step, dones: np.ndarray) -> None:
        self._steps.append(
            (self._obs, self._actions, step.next_obs, step.terminated, step.truncated, step.reward)
        )
        self._obs = step.obs
        self._returns += step.reward
        self._lengths += 1
        if not dones.any():
            return
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

    def advance(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`step` without what it says to SB3: the observations that follow, and which episodes ended.

        The array of actions is kept: nobody may write to it afterwards.
        """
        assert isinstance(self.venv, Envs)
        self._actions = actions
        step = self.venv.advance(actions)
        dones = step.terminated | step.truncated
        self._record(step, dones)
        return step.obs, dones

    def state_dict(self) -> dict[str, Any]:
        """Where every environment is; read between two rollouts, when nothing is recorded."""
        positions = [env.position() for env in self._envs()]
        return {"positions": positions, "returns": self._returns.copy(), "lengths": self._lengths.copy()}

    def load_state_dict(self, state: dict[str, Any], obs: Float[np.ndarray, "N O"]) -> None:
        """Bring the environments there by replaying their last episode so far.

        Args:
            obs: what was observed there.
        Raises:
            UserError: a replay does not lead there, because the task draws from a generator of its own.
        """
        for env, position, row in zip(self._envs(), state["positions"], obs, strict=True):
            env.check_restored(position, env.restore(position), row)
        self._returns, self._lengths = state["returns"].copy(), state["lengths"].copy()
        self._obs = obs

    def _envs(self) -> list[Replayable]:
        inner = self.venv
        assert isinstance(inner, DummyVecEnv)
        return inner.envs  # pyright: ignore[reportReturnType]


def _flat(obs: Any) -> np.ndarray:
    # `make` admits Box observations only, SB3's types do not know that
    assert isinstance(obs, np.ndarray)
    return obs
