"""Episodes of a policy in an environment, with every number that the hand-written reward is made of."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Real
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.spaces import Box
from jaxtyping import Float

from irl.core.errors import UserError
from irl.core.types import ActFn, Episode
from irl.envs.discrete import OneHot
from irl.envs.make import make
from irl.envs.tasks import task_of, terms_among

MOST = 100_000
"""Steps of an episode in a task without a time limit, after which it is taken for one that never ends."""


def rollout(env: gym.Env, act: ActFn, seed: int) -> Episode:
    """One episode of `act` in `env`, reset with `seed`; `env` stays open.

    Actions are clipped to the bounds and rounded to the action space's dtype before the environment sees
    them, so that the recorded action is the executed one. A task of `irl.envs.tasks` has its reward terms
    and the row's infos recorded, another environment every scalar number that each step's info has.

    Raises:
        UserError: the task has no time limit, and the episode does not end.
        ValueError: actions are no Box (`irl.envs.make.make` makes one of a choice); or one has the wrong
            shape or is not finite.
    """
    return record(env, act, seed)[0]


def record(env: gym.Env, act: ActFn, seed: int) -> tuple[Episode, dict[str, float]]:
    """The episode of `rollout`, and the scalar numbers in the info of its reset (e.g. `x_position`).

    Raises:
        UserError: the task has no time limit, and the episode does not end.
        ValueError: actions are no Box; or one has the wrong shape or is not finite.
    """
    space = env.action_space
    if not isinstance(space, Box):
        raise ValueError(
            f"expected an environment whose actions are a Box, not {space}; irl.envs.make.make(ENV_ID) makes "
            f"one of a choice of actions"
        )
    most = _most(env)
    start, reset_info = env.reset(seed=seed)
    # copies, here and below: an environment may return the same buffers at every step
    at_reset = {key: float(value) for key, value in reset_info.items() if isinstance(value, Real)}
    obs = [np.array(start, dtype=np.float64)]
    actions, rewards, infos = [], [], []
    terminated = truncated = False
    while not (terminated or truncated):
        if len(actions) == most:
            raise _endless(env, most)
        action = _executed(space, act(obs[-1]))
        after, reward, terminated, truncated, info = env.step(action)
        obs.append(np.array(after, dtype=np.float64))
        actions.append(action)
        rewards.append(reward)
        infos.append(dict(info))
    terms, others = _named(env, _columns(infos))
    episode = Episode(
        obs=np.array(obs),
        action=_finite(np.array(actions)),
        reward=np.array(rewards, dtype=np.float64),
        terminated=bool(terminated),
        truncated=bool(truncated),
        terms=terms,
        infos=others,
        seed=seed,
    )
    return episode, at_reset


def rollouts(
    env_id: str,
    act: ActFn,
    seeds: Iterable[int],
    on_episode: Callable[[Episode], None] | None = None,
) -> list[Episode]:
    """One episode of `act` a seed, in the order of `seeds`, in an environment made and closed here.

    Args:
        on_episode: called with each episode as it ends, e.g. to show progress.

    Raises:
        UserError: the environment cannot be made, or an episode does not end.
        ValueError: an action has the wrong shape or is not finite.
    """
    env = make(env_id)
    try:
        episodes = []
        for seed in seeds:
            episodes.append(rollout(env, act, seed))
            if on_episode is not None:
                on_episode(episodes[-1])
        return episodes
    finally:
        env.close()


def random_act(action_space: gym.Space, rng: np.random.Generator) -> ActFn:
    """The policy that draws every action uniformly within the bounds, or of the choices, from `rng`.

    Raises:
        ValueError: the action space is not a bounded Box.
    """
    if not isinstance(action_space, Box) or not action_space.is_bounded():
        raise ValueError(f"expected a bounded Box of actions, got {action_space}")
    if isinstance(space := action_space, OneHot):
        return lambda obs: space.rows(rng.integers(space.choices.n, size=1) + int(space.choices.start))[0]
    low, high = action_space.low.astype(np.float64), action_space.high.astype(np.float64)

    def act(obs: Float[np.ndarray, "O"]) -> Float[np.ndarray, "A"]:
        return rng.uniform(low, high)

    return act


def _most(env: gym.Env) -> int:
    limit = env.spec.max_episode_steps if env.spec is not None else None
    return max(MOST, limit or 0)


def _endless(env: gym.Env, steps: int) -> UserError:
    name = env.spec.id if env.spec is not None else type(env.unwrapped).__name__
    return UserError(
        f"{name} has no time limit, and an episode did not end in {steps:,} steps; whole episodes are "
        f"played, so give it a limit: --env-kwargs max_episode_steps=1000"
    )


def _executed(space: Box, chosen: Any) -> Float[np.ndarray, "A"]:
    """What the environment is given where a policy chose that."""
    wanted = np.asarray(chosen, dtype=space.dtype)
    if isinstance(space, OneHot):
        wanted = space.row(wanted)
    if wanted.shape != space.low.shape:
        raise ValueError(f"expected actions of shape {space.low.shape}, the policy gave {wanted.shape}")
    return np.minimum(np.maximum(wanted, space.low), space.high)


def _finite(actions: Float[np.ndarray, "T A"]) -> Float[np.ndarray, "T A"]:
    # once an episode: a check at every step would cost as much as the clipping
    finite = np.isfinite(actions).all(axis=1)
    if not finite.all():
        step = int(np.argmin(finite))
        raise ValueError(f"the policy gave the action {actions[step]} at step {step}")
    return actions


def _columns(infos: Sequence[Mapping[str, Any]]) -> dict[str, Float[np.ndarray, "T"]]:
    """The scalar numbers that every step has, by `info` key."""
    keys = [key for key, value in infos[0].items() if isinstance(value, Real)]
    return {
        key: np.array([info[key] for info in infos], dtype=np.float64)
        for key in keys
        if all(isinstance(info.get(key), Real) for info in infos)
    }


def _named(
    env: gym.Env, columns: dict[str, Float[np.ndarray, "T"]]
) -> tuple[dict[str, Float[np.ndarray, "T"]], dict[str, Float[np.ndarray, "T"]]]:
    """Columns by term name, and the other ones worth keeping."""
    task = task_of(env.spec.id) if env.spec is not None else None
    terms = terms_among(task, columns)
    if task is None or not terms:
        return {}, columns
    return terms, {key: columns[key] for key in task.infos if key in columns}
