"""Episodes as a Minari dataset, whole or not at all."""

import importlib.metadata
import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import minari
import numpy as np
from gymnasium.envs.mujoco import MujocoEnv
from gymnasium.spaces import Box
from minari.data_collector import EpisodeBuffer
from minari.namespace import NAMESPACE_METADATA_FILENAME

from irl.core import files
from irl.core.config import to_json
from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos.hdf5 import DATA, stored_key
from irl.demos.metadata import DIGEST, METADATA, RECORDED
from irl.demos.recording import Recorded
from irl.demos.root import datasets_root, minari_at
from irl.demos.storage import check_id
from irl.envs.discrete import OneHot
from irl.envs.tasks import task_of

NO_ACTIONS = Box(-1.0, 1.0, (0,), np.float64)
"""The space of the actions of demonstrations that have none."""


@dataclass(frozen=True)
class Origin:
    """Where the episodes were recorded."""

    obs_space: gym.Space
    action_space: gym.Space
    env_id: str | None
    env_spec: str | None
    """The environment as Gymnasium writes it down."""
    requirements: tuple[str, ...] = ()


@dataclass(frozen=True)
class Labels:
    """What a dataset says of itself; None is left out."""

    algorithm: str | None
    author: str | None
    description: str | None
    random_return: float | None = None
    """Mean return of random actions, the zero of a normalised score."""
    expert_return: float | None = None
    """Mean return of the expert, the one of a normalised score."""
    recorded: Recorded | None = None
    """How a policy's episodes were made, and which were dropped."""


def origin_of(env: gym.Env) -> Origin:
    """The origin of what was recorded in `env`.

    An environment that is registered as a function and not by its name cannot be written down: then its id
    is, and nobody can make it from the dataset alone.
    """
    requirements = [f"gymnasium=={importlib.metadata.version('gymnasium')}"]
    if isinstance(env.unwrapped, MujocoEnv):
        requirements.append(f"mujoco=={importlib.metadata.version('mujoco')}")
    spec, text = env.spec, None
    if spec is not None:
        try:
            text = spec.to_json()
        # ValueError: it holds a function; TypeError: an argument that JSON has not
        except (ValueError, TypeError):
            steps = spec.max_episode_steps
            bare = {"id": spec.id, "entry_point": None, "max_episode_steps": steps, "additional_wrappers": []}
            text = json.dumps(bare | {"kwargs": _written(spec.kwargs)})
    env_id = spec.id if spec is not None else None
    return Origin(env.observation_space, env.action_space, env_id, text, tuple(requirements))


def _written(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments as JSON, so that a variant is known by them; none where one of them is not."""
    try:
        return json.loads(json.dumps(arguments))
    except (ValueError, TypeError):
        return {}


def check_target(dataset_id: str, root: Path | str | None, overwrite: bool) -> Path:
    """The folder that the dataset goes to, once it is known to be free and to take files.

    Raises:
        UserError: not a dataset id, something else is there, or nothing can be written.
    """
    check_id(dataset_id)
    target = datasets_root(root) / dataset_id
    _check_free(dataset_id, target, overwrite)
    try:
        files.check_writable(target)
    except OSError as error:
        raise _not_written(target, error) from error
    return target


def write(
    target: Path,
    dataset_id: str,
    root: Path | str | None,
    episodes: Sequence[Episode],
    origin: Origin,
    labels: Labels,
    resets: Sequence[Mapping[str, float]] = (),
) -> None:
    """Write the dataset to the folder that `check_target` gave.

    Every number of an episode is under `infos` with its own `info` key (a `/` in it as %2F), first the row of
    the reset, as Minari has it: there a reward term is 0 and what the reset does not tell is NaN.

    Args:
        resets: the scalar numbers in the info of each episode's reset, where they are known.

    Raises:
        UserError: it cannot be written, or an `info` key is no text.
    """
    at_reset = resets or [{}] * len(episodes)
    buffers = [_buffer(e, r, origin) for e, r in zip(episodes, at_reset, strict=True)]
    space = origin.action_space.choices if isinstance(origin.action_space, OneHot) else origin.action_space
    if episodes[0].action.shape[1] == 0:
        space = NO_ACTIONS
    try:
        with files.new_folder(target) as folder, minari_at(folder / "aside"):
            # h5py prints a traceback for every piece that it cannot write
            files.check_room(folder, _most_bytes(buffers))
            dataset = minari.create_dataset_from_buffers(
                dataset_id,
                buffers,
                observation_space=origin.obs_space,
                action_space=space,
                algorithm_name=labels.algorithm,
                author=labels.author,
                description=labels.description,
                requirements=list(origin.requirements) or None,
                data_format="hdf5",
            )
            returns = [{"rewards_sum": float(np.sum(buffer.rewards))} for buffer in buffers]
            dataset.storage.update_episode_metadata(returns)
            os.rename(folder / "aside" / dataset_id / "data", folder / "data")
            shutil.rmtree(folder / "aside")
            metadata = files.read_json(folder / "data" / METADATA) | _more(origin, labels)
            digest = files.sha256(folder / "data" / DATA)
            files.write_json(folder / "data" / METADATA, metadata | {DIGEST: digest})
        _mark_namespaces(datasets_root(root), target)
    # RuntimeError: what h5py says where a file cannot be closed
    except (OSError, RuntimeError) as error:
        raise _not_written(target, error) from error


def _more(origin: Origin, labels: Labels) -> dict[str, Any]:
    """Metadata that Minari would make the environment once more for."""
    more = {
        RECORDED: to_json(labels.recorded),
        "env_spec": origin.env_spec,
        "ref_min_score": labels.random_return,
        "ref_max_score": labels.expert_return,
    }
    return {key: value for key, value in more.items() if value is not None}


def _check_free(dataset_id: str, target: Path, overwrite: bool) -> None:
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


def _buffer(episode: Episode, at_reset: Mapping[str, float], origin: Origin) -> EpisodeBuffer:
    """The episode as Minari stores it; infos have one row more than steps, the reset's first."""
    task = task_of(origin.env_id) if origin.env_id is not None else None
    keys = {name: key for key, name in task.terms.items()} if task is not None else {}
    # a constant of the task has no key, and is known without
    told = {keys[name]: values for name, values in episode.terms.items() if name in keys}
    infos = {key: np.concatenate([[0.0], values]) for key, values in told.items()}
    for key, values in episode.infos.items():
        infos[key] = np.concatenate([[at_reset.get(key, np.nan)], values])
    ended = np.zeros(len(episode), dtype=bool)
    ended[-1] = True
    actions = episode.action
    if isinstance(origin.action_space, OneHot) and actions.shape[1]:
        actions = origin.action_space.chosen(actions)
    return EpisodeBuffer(
        seed=episode.seed,
        # Minari's annotations say list; its storage takes any array
        observations=episode.obs,  # pyright: ignore[reportArgumentType]
        actions=actions,  # pyright: ignore[reportArgumentType]
        rewards=episode.reward,  # pyright: ignore[reportArgumentType]
        terminations=ended & episode.terminated,  # pyright: ignore[reportArgumentType]
        truncations=ended & episode.truncated,  # pyright: ignore[reportArgumentType]
        infos={stored_key(key): values for key, values in infos.items()} or None,
    )


def _most_bytes(buffers: Sequence[EpisodeBuffer]) -> int:
    """What the episodes take in HDF5, at most: each column its own bytes twice, in chunks, and an index."""
    names = ("observations", "actions", "rewards", "terminations", "truncations")
    columns = [c for b in buffers for c in (*(getattr(b, n) for n in names), *(b.infos or {}).values())]
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
