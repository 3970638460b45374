"""A Minari dataset of a policy's episodes, with everything that the hand-written reward is made of."""

from collections.abc import Callable, Sequence
from pathlib import Path

import gymnasium as gym
import numpy as np

from irl.core.errors import UserError
from irl.core.types import ActFn, Episode
from irl.demos.episodes import check_episode
from irl.demos.info import DemosInfo, show
from irl.demos.write import Labels, check_target, origin_of, write
from irl.envs.make import make
from irl.envs.rollouts import record


def generate(
    env_id: str,
    act: ActFn,
    *,
    dataset_id: str,
    root: Path | str | None = None,
    seeds: Sequence[int],
    algorithm: str,
    author: str,
    random_return: float | None,
    expert_return: float | None,
    description: str,
    on_episode: Callable[[Episode], None] | None = None,
    overwrite: bool = False,
) -> DemosInfo:
    """Write one episode of `act` a seed as a Minari dataset; what it then holds.

    Every number of `irl.envs.rollouts` is under `infos` with its own `info` key, first the row of the reset,
    as Minari has it: there a reward term is 0 and what the reset does not tell is NaN. The reference
    scores make `minari.get_normalized_score` work. The dataset appears whole or not at all.

    Args:
        random_return: mean return of random actions, the zero of a normalised score.
        expert_return: mean return of the expert, the one of a normalised score; that of these episodes
            where it is None.
        overwrite: replace a dataset of this id.

    Raises:
        UserError: no such environment, not a dataset id, no seeds, already there, or cannot be written.
    """
    target = check_target(dataset_id, root, overwrite)
    if not seeds:
        raise UserError(f"no seeds for {dataset_id}; expected at least one episode")
    env = make(env_id)
    try:
        episodes, resets = _record_all(env_id, env, act, seeds, on_episode)
        if expert_return is None:
            expert_return = float(np.mean([episode.return_ for episode in episodes]))
        labels = Labels(algorithm, author, description, random_return, expert_return)
        write(target, dataset_id, root, episodes, origin_of(env), labels, resets)
    finally:
        env.close()
    return show(dataset_id, root)


def _record_all(
    env_id: str,
    env: gym.Env,
    act: ActFn,
    seeds: Sequence[int],
    on_episode: Callable[[Episode], None] | None,
) -> tuple[list[Episode], list[dict[str, float]]]:
    """The episodes, and what the reset of each said."""
    episodes, resets = [], []
    for seed in seeds:
        episode, at_reset = record(env, act, seed)
        try:
            check_episode(len(episodes), episode)
        except ValueError as error:
            raise UserError(f"{env_id} cannot be demonstrated: {error}; nothing was written") from error
        episodes.append(episode)
        resets.append(at_reset)
        if on_episode is not None:
            on_episode(episode)
    return episodes, resets
