"""A Minari dataset of a policy's episodes, with everything that the hand-written reward is made of."""

import importlib.metadata
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import minari
import numpy as np
from gymnasium.envs.mujoco import MujocoEnv
from minari.data_collector import EpisodeBuffer
from minari.namespace import NAMESPACE_METADATA_FILENAME

from irl.core import files
from irl.core.errors import UserError
from irl.core.types import ActFn, Episode
from irl.demos.episodes import DATA, check_episode
from irl.demos.info import DemosInfo, show
from irl.demos.root import datasets_root, minari_at
from irl.demos.storage import DIGEST, METADATA, check_id
from irl.envs.make import make
from irl.envs.rollouts import record
from irl.envs.tasks import task_of


def generate(
    env_id: str,
    act: ActFn,
    *,
    dataset_id: str,
    root: Path | str | None = None,
    seeds: Sequence[int],
    algorithm: str,
    author: str,
    random_return: float,
    expert_return: float,
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
        expert_return: mean return of the expert, the one of a normalised score.
        overwrite: replace a dataset of this id.

    Raises:
        UserError: no such environment, not a dataset id, no seeds, already there, or cannot be written.
    """
    check_id(dataset_id)
    target = datasets_root(root) / dataset_id
    _check_target(dataset_id, target, overwrite)
    if not seeds:
        raise UserError(f"no seeds for {dataset_id}; expected at least one episode")
    labels = {"algorithm_name": algorithm, "author": author, "description": description}
    scores = {"ref_min_score": float(random_return), "ref_max_score": float(expert_return)}
    try:
        files.check_writable(target)
    except OSError as error:
        raise _not_written(target, error) from error
    env = make(env_id)
    try:
        buffers = _record_all(env_id, env, act, seeds, on_episode)
        _write(target, dataset_id, env, buffers, labels, scores)
        _mark_namespaces(datasets_root(root), target)
    finally:
        env.close()
    return show(dataset_id, root)


def _check_target(dataset_id: str, target: Path, overwrite: bool) -> None:
    for folder in target.parents:
        if (folder / "data" / METADATA).is_file():
            raise UserError(f"{folder} is a dataset; choose another id than {dataset_id!r}, not inside it")
    if not target.exists():
        return
    # a folder of datasets must never be replaced by one of them
    if not (target / "data").is_dir():
        raise UserError(f"{target} is there and is not a dataset; choose another id than {dataset_id!r}")
    if not overwrite:
        raise UserError(f"dataset {dataset_id} is already in {target}; --overwrite replaces it")


def _record_all(
    env_id: str,
    env: gym.Env,
    act: ActFn,
    seeds: Sequence[int],
    on_episode: Callable[[Episode], None] | None,
) -> list[EpisodeBuffer]:
    buffers = []
    for seed in seeds:
        episode, at_reset = record(env, act, seed)
        try:
            check_episode(len(buffers), episode)
        except ValueError as error:
            raise UserError(f"{env_id} cannot be demonstrated: {error}; nothing was written") from error
        buffers.append(_buffer(env_id, episode, at_reset))
        if on_episode is not None:
            on_episode(episode)
    return buffers


def _buffer(env_id: str, episode: Episode, at_reset: dict[str, float]) -> EpisodeBuffer:
    """The episode as Minari stores it; infos have one row more than steps, the reset's first."""
    task = task_of(env_id)
    keys = {name: key for key, name in task.terms.items()} if task is not None else {}
    infos = {keys[name]: np.concatenate([[0.0], values]) for name, values in episode.terms.items()}
    for key, values in episode.infos.items():
        infos[key] = np.concatenate([[at_reset.get(key, np.nan)], values])
    ended = np.zeros(len(episode), dtype=bool)
    ended[-1] = True
    return EpisodeBuffer(
        seed=episode.seed,
        # Minari's annotations say list; its storage takes any array
        observations=episode.obs,  # pyright: ignore[reportArgumentType]
        actions=episode.action,  # pyright: ignore[reportArgumentType]
        rewards=episode.reward,  # pyright: ignore[reportArgumentType]
        terminations=ended & episode.terminated,  # pyright: ignore[reportArgumentType]
        truncations=ended & episode.truncated,  # pyright: ignore[reportArgumentType]
        infos=infos or None,
    )


def _write(
    target: Path,
    dataset_id: str,
    env: gym.Env,
    buffers: list[EpisodeBuffer],
    labels: dict[str, Any],
    scores: dict[str, float],
) -> None:
    """Minari's files in a folder aside, then in place."""
    requirements = [f"gymnasium=={importlib.metadata.version('gymnasium')}"]
    if isinstance(env.unwrapped, MujocoEnv):
        requirements.append(f"mujoco=={importlib.metadata.version('mujoco')}")
    try:
        with files.new_folder(target) as folder, minari_at(folder / "aside"):
            # h5py prints a traceback for every piece that it cannot write
            files.check_room(folder, _most_bytes(buffers))
            dataset = minari.create_dataset_from_buffers(
                dataset_id, buffers, env=env, requirements=requirements, data_format="hdf5", **labels
            )
            # given with the rest, the scores would make Minari build the environment once more
            dataset.storage.update_metadata(scores)
            returns = [{"rewards_sum": float(np.sum(buffer.rewards))} for buffer in buffers]
            dataset.storage.update_episode_metadata(returns)
            os.rename(folder / "aside" / dataset_id / "data", folder / "data")
            shutil.rmtree(folder / "aside")
            metadata = files.read_json(folder / "data" / METADATA)
            digest = files.sha256(folder / "data" / DATA)
            files.write_json(folder / "data" / METADATA, metadata | {DIGEST: digest})
    # RuntimeError: what h5py says where a file cannot be closed
    except (OSError, RuntimeError) as error:
        raise _not_written(target, error) from error


def _most_bytes(buffers: list[EpisodeBuffer]) -> int:
    """What the episodes take in HDF5, at most: each column its own bytes twice, in chunks, and an index."""
    columns = [
        column
        for b in buffers
        for column in (
            b.observations,
            b.actions,
            b.rewards,
            b.terminations,
            b.truncations,
            *(b.infos or {}).values(),
        )
    ]
    return sum(2 * np.asarray(column).nbytes + 4096 for column in columns)


def _not_written(target: Path, error: Exception) -> UserError:
    said = (error.strerror if isinstance(error, OSError) else None) or error
    return UserError(
        f"cannot write {target}: {said}; name a folder that can be written, with space, with --datasets-root"
    )


def _mark_namespaces(root: Path, target: Path) -> None:
    """Leave the files by which Minari tells a folder of datasets from another folder."""
    for folder in target.parents:
        if folder == root:
            return
        mark = folder / NAMESPACE_METADATA_FILENAME
        if not mark.exists():
            files.write_json(mark, {})
