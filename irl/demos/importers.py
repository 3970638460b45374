"""Demonstrations from a file of somebody else's, held against the task and written as a dataset."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium.spaces import Box

from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos.borders import split_episodes
from irl.demos.bounds import first_outside
from irl.demos.episodes import Columns, Layout, has_rewards, to_episode
from irl.demos.info import DemosInfo, show
from irl.demos.sources import read_source
from irl.demos.write import NO_ACTIONS, Labels, check_target, origin_of, write
from irl.envs.discrete import OneHot
from irl.envs.make import make
from irl.envs.tasks import task_of


def import_file(
    path: Path,
    env_id: str,
    *,
    dataset_id: str,
    root: Path | str | None = None,
    random_return: Callable[[], float | None] = lambda: None,
    author: str | None = None,
    overwrite: bool = False,
) -> tuple[DemosInfo, tuple[str, ...]]:
    """Write the episodes of a file as a Minari dataset of `env_id`; what it holds, and what was left out.

    `irl.demos.sources` says which files there are and `irl.demos.borders` how episodes lie in them. The
    dataset's expert return is the mean of these episodes, where their rewards were recorded.

    Args:
        random_return: what random actions come to; asked where rewards were recorded.

    Raises:
        UserError: the file cannot be read, or is of another task; names episode and step. Or the dataset
            cannot be written.
    """
    target = check_target(dataset_id, root, overwrite)
    env = make(env_id)
    try:
        try:
            split = split_episodes(source := read_source(path))
            state_only = "actions" not in source.arrays
            episodes = [_episode(c, i, env_id, env, state_only) for i, c in enumerate(split.episodes)]
        except ValueError as error:
            said = str(error)
            raise UserError(said if said.startswith(str(path)) else f"{path}: {said}") from error
        references = (None, None)
        if has_rewards(episodes):
            references = (random_return(), float(np.mean([episode.return_ for episode in episodes])))
        labels = Labels("imported", author, f"from {path.name}", *references)
        write(target, dataset_id, root, episodes, origin_of(env), labels)
    finally:
        env.close()
    return show(dataset_id, root), split.notes + _doubts(episodes, env_id, env)


def _doubts(episodes: list[Episode], env_id: str, env: gym.Env) -> tuple[str, ...]:
    """A note where what says that the task ended the episodes fits a time limit better."""
    limit = env.spec.max_episode_steps if env.spec is not None else None
    ended = [len(episode) for episode in episodes if episode.terminated and not episode.truncated]
    if not ended or any(steps != limit for steps in ended):
        return ()
    return (
        f"all {len(ended)} episodes that the task ended by `terminals` have exactly the {limit} steps that "
        f"{env_id} is cut off after: these look like ends of any kind (`dones`); if they are, call the array "
        f"`timeouts` and import with --overwrite, or else a reward is learned as if the task had ended there",
    )


def _episode(columns: Columns, index: int, env_id: str, env: gym.Env, state_only: bool) -> Episode:
    """The episode, once it is known that it may have happened in `env`.

    Raises:
        ValueError: names episode, step and column.
    """
    obs, action = env.observation_space, env.action_space
    assert isinstance(obs, Box)
    assert isinstance(action, Box)
    if (size := columns.observations.shape[-1]) != obs.shape[0]:  # pyright: ignore[reportAttributeAccessIssue]
        raise ValueError(f"its observations have {size} numbers; {env_id} has {obs.shape[0]}")
    choices = action.choices if isinstance(action, OneHot) else action
    space = NO_ACTIONS if state_only else choices
    columns = columns if state_only else _with_actions(columns, index, env_id, action)
    episode = to_episode(columns, index, Layout(obs.shape[0], space, task_of(env_id)))
    limit = env.spec.max_episode_steps if env.spec is not None else None
    if limit is not None and len(episode) > limit:
        raise ValueError(
            f"episode {index} has {len(episode)} steps, {env_id} ends after {limit}: the end of an episode "
            f"is not marked, or it was recorded with --env-kwargs max_episode_steps={len(episode)}"
        )
    checked = {"observations": (episode.obs, obs)}
    if not state_only:
        checked["actions"] = (episode.action, action)
    for name, (rows, box) in checked.items():
        if (place := first_outside(rows, box)) is not None:
            step, column = place
            raise ValueError(
                f"episode {index} has {rows[place]:g} in {name}, column {column}, at step {step}; {env_id} "
                f"has {box.low[column]:g} to {box.high[column]:g} there: {_WHY[name]}"
            )
    return episode


_WHY = {
    "actions": "record actions as the environment gets them, clipped",
    "observations": "another unit, a normalised observation, or a space of the environment that is too small",
}


def _with_actions(columns: Columns, index: int, env_id: str, space: Box) -> Columns:
    """The same with actions as a dataset has them: numbers in rows, or choices as whole numbers."""
    given = columns.actions
    if given.ndim == 1 and not isinstance(space, OneHot):
        given = given[:, None]
    if not isinstance(space, OneHot):
        if given.shape[1:] != space.shape:
            raise ValueError(f"its actions have {given.shape[1:]} numbers; {env_id} has {space.shape}")
        return replace(columns, actions=given.astype(np.float64) if given.dtype.kind != "f" else given)
    if given.ndim == 2 and given.shape[1] == space.shape[0] > 1:
        one = (given == 0.0) | (given == 1.0)
        wrong = np.flatnonzero(~one.all(axis=1) | (given.sum(axis=1) != 1.0))
        if len(wrong):
            raise ValueError(
                f"episode {index} has the action {given[wrong[0]]} at step {wrong[0]}; {env_id} has a choice "
                f"of {space.shape[0]}: expected its number, or a row with a single 1"
            )
        return replace(columns, actions=space.chosen(given.astype(np.float32)))
    given = given.reshape(len(given), -1)
    if given.shape[1] != 1 or (given != np.floor(given)).any():
        raise ValueError(
            f"episode {index} has actions that are no choices of {env_id}, whole numbers of {space}"
        )
    return replace(columns, actions=given[:, 0].astype(np.int64))
