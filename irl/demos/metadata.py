"""What the metadata of a Minari dataset say, read without running anything that they name."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import minari
from gymnasium.envs.registration import parse_env_id
from gymnasium.spaces import Box, Dict, Discrete
from minari.serialization import deserialize_space

from irl.core.config import from_json
from irl.core.errors import UserError
from irl.demos.arrow import FORMATS
from irl.demos.episodes import Layout
from irl.demos.recording import Recorded
from irl.envs.flatten import flat_space
from irl.envs.make import check_flat
from irl.envs.names import OBS_KEYS, full_name
from irl.envs.tasks import task_of

METADATA = "metadata.json"
DIGEST = "irl_data_sha256"
"""Key of the metadata with the SHA-256 of the data: damaged HDF5 can take the whole process down."""
RECORDED = "irl_recorded"
"""Key of the metadata with what `irl.demos.recording` says of the episodes."""
LONGEST_ID = 200


@dataclass(frozen=True)
class Dataset:
    """What the metadata of a dataset say."""

    dataset_id: str
    path: Path
    """Its folder; the files are in `path / "data"`."""
    form: str
    """How they are stored: `hdf5`, `arrow` or `parquet`."""
    obs_space: Box
    """Of the row that an observation is, or its named parts make."""
    obs_keys: tuple[str, ...]
    action_space: Box | Discrete
    episodes: int
    env_id: str | None
    env_name: str | None
    """The task's full name (`irl.envs.names`): the id with the arguments that make it a variant."""
    env_spec: str | None
    """Gymnasium's own words on the environment; of them the id and the arguments are read, as data."""
    algorithm: str | None
    author: str | None
    description: str | None
    random_return: float | None
    """Mean return of random actions, the zero of a normalised score."""
    expert_return: float | None
    """Mean return of the expert, the one of a normalised score."""
    recorded: Recorded | None
    """How a policy's episodes were made; None where irl did not make them."""
    digest: str | None

    @property
    def layout(self) -> Layout:
        """What its episodes look like."""
        task = task_of(self.env_id) if self.env_id is not None else None
        assert self.obs_space.shape is not None
        return Layout(self.obs_space.shape[0], self.action_space, task, self.obs_keys)


def parse(dataset_id: str, path: Path, content: Any, obs_keys: tuple[str, ...]) -> Dataset:
    """The dataset whose metadata are `content`.

    Args:
        obs_keys: parts of a dictionary of observations to put in a row.

    Raises:
        UserError, ValueError, LookupError, TypeError, AttributeError, AssertionError: they are no metadata,
            or of a dataset that is not usable; ours, and what Minari and Gymnasium raise.
    """
    metadata = from_json(dict[str, Any], content, METADATA)

    def optional(kind: Any, key: str) -> Any:
        return from_json(kind | None, metadata.get(key), f"{METADATA}.{key}")

    version, form = metadata.get("minari_version"), metadata.get("data_format")
    if version not in minari.supported_dataset_versions:
        raise ValueError(f"minari_version {version!r:.40}; Minari {minari.__version__} does not know it")
    if form not in ("hdf5", *FORMATS):
        raise ValueError(f"data_format {form!r:.40}; expected 'hdf5', {', '.join(map(repr, FORMATS))}")
    return Dataset(
        dataset_id=dataset_id,
        path=path,
        form=form,
        obs_space=_obs_space(metadata, obs_keys),
        obs_keys=obs_keys,
        action_space=_action_space(metadata),
        episodes=from_json(int, metadata.get("total_episodes"), f"{METADATA}.total_episodes"),
        env_id=_env_id(spec := optional(str, "env_spec")),
        env_name=env_name(spec, obs_keys),
        env_spec=spec,
        algorithm=optional(str, "algorithm_name"),
        author=_author(metadata.get("author")),
        description=optional(str, "description"),
        random_return=optional(float, "ref_min_score"),
        expert_return=optional(float, "ref_max_score"),
        recorded=optional(Recorded, RECORDED),
        digest=optional(str, DIGEST),
    )


def _author(content: Any) -> str | None:
    """One name or several: older datasets have a string."""
    names = [content] if isinstance(content, str) else content or []
    return ", ".join(sorted(from_json(tuple[str, ...], names, f"{METADATA}.author"))) or None


def _obs_space(metadata: Mapping[str, Any], keys: tuple[str, ...]) -> Box:
    space = _space(metadata, "observation")
    if keys:
        return flat_space("it", space, keys)
    if isinstance(space, Dict):
        raise UserError(
            f"it has the observations {' '.join(str(space).split()):.120}; expected a flat Box of real "
            f"numbers: name the parts to be put in a row, in Python obs_keys={list(space.spaces)!r:.100}, "
            f"with `irl demos` --obs-keys {' '.join(map(str, space.spaces)):.100}"
        )
    check_flat("it", "observations", space)
    return space


def _action_space(metadata: Mapping[str, Any]) -> Box | Discrete:
    space = _space(metadata, "action")
    if not isinstance(space, Discrete):
        check_flat("it", "actions", space)
    return space


def _space(metadata: Mapping[str, Any], of: str) -> Any:
    if (key := f"{of}_space") not in metadata:
        raise ValueError(f"{METADATA} names no {key}, and irl makes no environment that a file names")
    return deserialize_space(from_json(str, metadata[key], f"{METADATA}.{key}"))


def _env_id(spec: str | None) -> str | None:
    """The id that a dataset's `env_spec` names; nothing else of it is looked at."""
    if spec is None:
        return None
    env_id = from_json(str, from_json(dict[str, Any], json.loads(spec), "env_spec").get("id"), "env_spec.id")
    if ":" in env_id or len(env_id) > LONGEST_ID:
        # gymnasium would import what stands before the colon; the id it records never has one
        raise ValueError(f"env_spec names the environment {env_id!r:.80}; expected an id without a module")
    parse_env_id(env_id)
    return env_id


def env_name(spec: str | None, obs_keys: tuple[str, ...] = ()) -> str | None:
    """The full name of the task that an `env_spec` is of; its arguments are compared and shown, never used.

    Args:
        obs_keys: parts of a dictionary of observations that are put in a row on reading.

    Raises:
        UserError, ValueError: it is no JSON, names no id that is one, or its arguments are no object.
    """
    if spec is None or (env_id := _env_id(spec)) is None:
        return None
    given = from_json(dict[str, Any], json.loads(spec).get("kwargs", {}), "env_spec.kwargs")
    # gymnasium writes the arguments of the registration down too, and those are the id's own
    own = gym.registry[env_id].kwargs if env_id in gym.registry else {}
    usual = {name: json.dumps(value, default=str) for name, value in own.items()}
    # how it is looked at is no part of the task
    usual["render_mode"] = json.dumps(given.get("render_mode"))
    shown = {name: value for name, value in given.items() if json.dumps(value) != usual.get(name)}
    if obs_keys:
        shown[OBS_KEYS] = list(obs_keys)
    return full_name(env_id, (json.dumps(shown),))
