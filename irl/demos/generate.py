"""A Minari dataset of a policy's episodes, with everything that the hand-written reward is made of."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from irl.core.errors import UserError
from irl.core.types import ActFn, Episode
from irl.demos.episodes import check_episode
from irl.demos.info import DemosInfo, show
from irl.demos.players import Play, Played, play_here
from irl.demos.recording import Recording, keep
from irl.demos.write import Labels, check_target, origin_of, write
from irl.envs.make import make


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
    how: Recording | None = None,
    play: Play = play_here,
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
        how: what is done to the actions, and which episodes are kept; the policy as it is, and all.
        play: where the episodes are played.
        on_episode: called with each as it was played, also with one that is dropped.
        overwrite: replace a dataset of this id.

    Raises:
        UserError: no such environment, not a dataset id, no seeds, already there, cannot be written, or no
            episode is kept.
    """
    target, how = check_target(dataset_id, root, overwrite), how or Recording()
    if not seeds:
        raise UserError(f"no seeds for {dataset_id}; expected at least one episode")
    env = make(env_id)
    origin = origin_of(env)
    env.close()
    played = _all(env_id, act, how, seeds, play, on_episode)
    kept, recorded = keep([episode for episode, _ in played], how)
    episodes, resets = [played[i][0] for i in kept], [played[i][1] for i in kept]
    if expert_return is None:
        expert_return = float(np.mean([episode.return_ for episode in episodes]))
    labels = Labels(algorithm, author, description, random_return, expert_return, recorded)
    write(target, dataset_id, root, episodes, origin, labels, resets)
    return show(dataset_id, root)


def _all(
    env_id: str,
    act: ActFn,
    how: Recording,
    seeds: Sequence[int],
    play: Play,
    on_episode: Callable[[Episode], None] | None,
) -> list[Played]:
    """What was played, once it is known to be finite."""
    found: list[Played] = []
    for played in play(env_id, act, how, seeds):
        try:
            check_episode(len(found), played[0])
        except ValueError as error:
            raise UserError(f"{env_id} cannot be demonstrated: {error}; nothing was written") from error
        found.append(played)
        if on_episode is not None:
            on_episode(played[0])
    return found
