"""Several copies of one planar MuJoCo task, stepped together: the simulator's steps and little else.

`Hopper-v5`, `Walker2d-v5` and `HalfCheetah-v5` compute observation, reward and health in Python, one copy at
a time, behind four wrappers; that takes more than half as long as their physics. Here each copy takes its
simulator's step, and the rest is arithmetic on all copies at once, in the order of Gymnasium's own, so that
every number is the same to the bit (a test holds observations, rewards and ends against the wrapped tasks).
What a step's `info` holds is not computed. Every other task, and these behind other wrappers, is stepped as
it asks to be.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from gymnasium.envs.mujoco.half_cheetah_v5 import HalfCheetahEnv
from gymnasium.envs.mujoco.hopper_v5 import HopperEnv
from gymnasium.envs.mujoco.walker2d_v5 import Walker2dEnv
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit
from jaxtyping import Bool, Float

from irl.envs.guard import Guarded
from irl.envs.replayable import Replayable


@dataclass(frozen=True)
class _Rules:
    """What a task does beside moving forward at a cost."""

    clips: bool
    """Velocities in the observation are held within +-10."""
    falls: bool
    """It ends at an unhealthy height or angle."""
    bounded: bool
    """It ends, too, where any number of its state but the first two is out of range."""


RULES = {
    HopperEnv: _Rules(clips=True, falls=True, bounded=True),
    Walker2dEnv: _Rules(clips=True, falls=True, bounded=False),
    HalfCheetahEnv: _Rules(clips=False, falls=False, bounded=False),
}

KNOWN = (Guarded, TimeLimit, OrderEnforcing, PassiveEnvChecker)
"""Wrappers whose part in a step is known here."""


class Planar:
    """Copies of one task; each is reset by itself, and stepped here."""

    def __init__(self, envs: Sequence[Replayable]) -> None:
        """The caller has asked `can_step`."""
        self._envs, self._guards = envs, [_inside(env, Guarded) for env in envs]
        tasks: list[Any] = [env.unwrapped for env in envs]
        self._task, self._rules = tasks[0], RULES[type(tasks[0])]
        limit = _inside(envs[0], TimeLimit)
        self._limit = np.inf if limit is None else limit._max_episode_steps
        # views of the simulators' own memory, which stays where it is
        self._simulators = [
            (task.model, task.data, task.data.ctrl, task.data.qpos, task.data.qvel) for task in tasks
        ]
        self._skip = self._task.frame_skip
        n, model = len(tasks), self._task.model
        self._before, self._lengths = np.zeros(n), np.zeros(n)
        self._qpos, self._qvel = np.zeros((n, model.nq)), np.zeros((n, model.nv))

    def step(
        self, actions: Float[np.ndarray, "N A"]
    ) -> tuple[
        Float[np.ndarray, "N O"], Float[np.ndarray, "N"], Bool[np.ndarray, "N"], Bool[np.ndarray, "N"]
    ]:
        """Observations, rewards, terminated, truncated: the same as each copy's own `step`.

        Raises:
            UserError: an observation is not finite.
        """
        # the bindings have it, their type stubs lack it
        step = getattr(mujoco, "mj_step")  # noqa: B009
        before, lengths, all_qpos, all_qvel = self._before, self._lengths, self._qpos, self._qvel
        for i, (model, data, ctrl, qpos, qvel) in enumerate(self._simulators):
            before[i] = qpos[0]
            ctrl[:] = actions[i]
            step(model, data, self._skip)
            all_qpos[i], all_qvel[i] = qpos, qvel
            lengths[i] = self._envs[i].note(actions[i])
        obs = self._observed()
        if not np.isfinite(obs).all():
            for i, guard in enumerate(self._guards):
                guard.check(obs[i], int(lengths[i]) - 1, actions[i])
        healthy = self._healthy()
        ends = self._rules.falls and self._task._terminate_when_unhealthy
        terminated = ~healthy if ends else np.zeros(len(obs), dtype=bool)
        return obs, self._rewards(actions, healthy), terminated, lengths >= self._limit

    def _observed(self) -> Float[np.ndarray, "N O"]:
        position = self._qpos[:, 1:] if self._task._exclude_current_positions_from_observation else self._qpos
        velocity = np.clip(self._qvel, -10, 10) if self._rules.clips else self._qvel
        return np.concatenate((position, velocity), axis=1)

    def _healthy(self) -> Bool[np.ndarray, "N"]:
        if not self._rules.falls:
            return np.ones(len(self._qpos), dtype=bool)
        task, (z, angle) = self._task, self._qpos.T[1:3]
        (low, high), (left, right) = task._healthy_z_range, task._healthy_angle_range
        healthy = (low < z) & (z < high) & (left < angle) & (angle < right)
        if self._rules.bounded:
            least, most = task._healthy_state_range
            for state in (self._qpos[:, 2:], self._qvel):
                healthy &= ((least < state) & (state < most)).all(1)
        return healthy

    def _rewards(
        self, actions: Float[np.ndarray, "N A"], healthy: Bool[np.ndarray, "N"]
    ) -> Float[np.ndarray, "N"]:
        task = self._task
        rewards = task._forward_reward_weight * ((self._qpos[:, 0] - self._before) / task.dt)
        if self._rules.falls:
            rewards = rewards + healthy * task._healthy_reward
        return rewards - task._ctrl_cost_weight * np.square(actions).sum(1)


def can_step(envs: Sequence[gym.Env]) -> bool:
    """Whether `Planar` steps these, copies of one task, as they step themselves."""
    return all(_known(env) for env in envs)


def _known(env: gym.Env) -> bool:
    if not isinstance(env, Replayable):
        return False
    inner: gym.Env = env.env
    while type(inner) in KNOWN:
        assert isinstance(inner, gym.Wrapper)
        inner = inner.env
    return type(inner) in RULES and inner.render_mode is None


def _inside(env: gym.Env, wrapper: type[gym.Wrapper]) -> Any:
    """The wrapper of that type around the task; None where there is none."""
    while isinstance(env, gym.Wrapper):
        if type(env) is wrapper:
            return env
        env = env.env
    return None
