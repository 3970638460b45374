"""Episodes played here or in several processes; the same either way."""

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import lru_cache, partial

import gymnasium as gym
from gymnasium.envs.registration import EnvSpec

from irl.core.types import ActFn, Episode
from irl.demos.recording import Recording
from irl.envs.behaviour import behaving
from irl.envs.make import make
from irl.envs.names import split_name
from irl.envs.rollouts import record

Played = tuple[Episode, dict[str, float]]
"""An episode, and the scalar numbers in the info of its reset."""

_CHUNKS = 4
"""Pieces that each worker gets of the episodes: few, and the last to be done is not waited for long."""


Play = Callable[[str, ActFn, Recording, Sequence[int]], Iterator[Played]]
"""Yields an episode a seed, in their order."""


def play_here(env_id: str, act: ActFn, how: Recording, seeds: Sequence[int]) -> Iterator[Played]:
    """An episode a seed, in this process.

    Raises:
        UserError: the environment cannot be made, or the policy cannot behave so.
        ValueError: an action has the wrong shape or is not finite.
    """
    env = make(env_id)
    try:
        for seed in seeds:
            yield _played(env, act, how, seed)
    finally:
        env.close()


@contextmanager
def players(workers: int) -> Iterator[Play]:
    """What plays in so many processes, each with an environment of its own; in this one where it is 1.

    A policy goes to the others as a pickle, and with it how its task is registered: one that is registered as
    a function, which has no pickle, is played here.
    """
    if workers == 1:
        yield play_here
        return
    # not forked: the threads of torch do not survive it
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        try:
            yield partial(_play_in, pool, workers)
        finally:
            pool.shutdown(cancel_futures=True)


def _play_in(
    pool: ProcessPoolExecutor, workers: int, env_id: str, act: ActFn, how: Recording, seeds: Sequence[int]
) -> Iterator[Played]:
    spec = gym.registry.get(split_name(env_id)[0])
    if spec is None or callable(spec.entry_point):
        yield from play_here(env_id, act, how, seeds)
        return
    size = max(len(seeds) // (workers * _CHUNKS), 1)
    pieces = [seeds[i : i + size] for i in range(0, len(seeds), size)]
    for piece in [pool.submit(_piece, spec, env_id, act, how, part) for part in pieces]:
        yield from piece.result()


def _piece(spec: EnvSpec, env_id: str, act: ActFn, how: Recording, seeds: Sequence[int]) -> list[Played]:
    # a process of its own knows the tasks of Gymnasium only
    gym.registry.setdefault(spec.id, spec)
    return [_played(_kept(env_id), act, how, seed) for seed in seeds]


@lru_cache(maxsize=1)
def _kept(env_id: str) -> gym.Env:
    """The task's environment, one for all pieces: some take a tenth of a second to make."""
    return make(env_id)


def _played(env: gym.Env, act: ActFn, how: Recording, seed: int) -> Played:
    return record(env, behaving(act, how.behaviour, env.action_space, how.seed, seed), seed)
