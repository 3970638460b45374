"""Which demonstrations a run learns from: drawn once, written down, and the same ever after."""

import hashlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from irl.core import files
from irl.core.errors import UserError
from irl.core.records import RunFolder
from irl.core.types import Episode
from irl.demos.load import Demos, check_task, load_demos, other_variant
from irl.discriminators.airl import AIRLConfig
from irl.envs.flatten import part_names
from irl.envs.make import check_module, make
from irl.envs.names import OBS_KEYS, split_name
from irl.experiment.build import check_discriminator, check_learner, demonstrations
from irl.experiment.configs import BCRun, FromDemonstrations, OffPolicyRun
from irl.experiment.judge import finite

RECORD = "demonstrations.json"


def draw(config: FromDemonstrations) -> Demos:
    """The demonstrations that the settings name; a line on stderr where they are of a variant of the task.

    Raises:
        UserError: there are none, too few, or they are of another task; or the task cannot be started.
    """
    return _drawn_of(config, config.datasets_root, warn=True)


def _drawn_of(config: FromDemonstrations, root: Path | None, *, warn: bool = False) -> Demos:
    """The demonstrations, once they are known to be of the task and the task is known to start."""
    env = make(config.env_id)
    try:
        demos = _loaded(config, root)
        check_learner(config.learner.KIND, env)
        if not isinstance(config, BCRun):
            check_discriminator(config.discriminator, env)
        check_task(demos, env, seen=_sees_actions(config))
        _check_rate(config, demos)
        env.reset(seed=config.seed)
        box = env.action_space
        assert isinstance(box, Box)
        action = demos[0].action[0] if demos[0].action.shape[1] else (box.low + box.high) / 2
        env.step(action.astype(box.dtype))
        if warn and (line := other_variant(demos, env)) is not None:
            print(f"irl: {line}", file=sys.stderr)
        return demos
    finally:
        env.close()


def _sees_actions(config: FromDemonstrations) -> bool:
    """Whether it learns from the actions of the demonstrations, and not from their states alone."""
    if isinstance(config, BCRun) or config.warm_start.updates:
        return True
    if isinstance(config, OffPolicyRun) and config.schedule.expert_share:
        # they stand beside the learner's own, in one batch
        return True
    # AIRL takes the density of the actions off, whatever g sees
    return "action" in config.discriminator.inputs or isinstance(config.discriminator, AIRLConfig)


def _check_rate(config: FromDemonstrations, demos: Demos) -> None:
    try:
        demonstrations(config, demos.episodes)
    except ValueError as error:
        longest = max(len(episode) for episode in demos)
        raise UserError(
            f"{error}: the longest has {longest} steps, and where each begins is drawn; take a smaller "
            f"--demo-rate than {config.demo_rate}, or more --demo-episodes"
        ) from error


def _loaded(config: FromDemonstrations, root: Path | None) -> Demos:
    given = {"episodes": config.demo_episodes, "seed": config.seed, "root": root}
    try:
        return load_demos(config.demos, **given)
    except UserError:
        keys = split_name(config.env_id)[1].get(OBS_KEYS)
        if not keys:
            raise
        # observations in a dictionary, of which the task's name says the parts
        return load_demos(config.demos, obs_keys=part_names(keys), **given)


def drawn(demos: Demos) -> dict[str, Any]:
    """What is written down of them."""
    return {
        "dataset": demos.dataset_id,
        "episodes": list(demos.indices),
        "held_out": list(demos.held_out_indices),
        # None: not recorded
        "returns": [finite(episode.return_) for episode in demos],
        "held_out_returns": [finite(episode.return_) for episode in demos.held_out],
        # returns may be the same, or none, of other episodes
        "sha256": _digest((*demos.episodes, *demos.held_out)),
    }


def _digest(episodes: Sequence[Episode]) -> str:
    """SHA-256 of every number of the episodes that something is learned from or judged by."""
    digest = hashlib.sha256()
    for episode in episodes:
        for column in (episode.obs, episode.action, episode.reward):
            digest.update(repr(column.shape).encode())
            digest.update(np.asarray(column, dtype=np.float64).tobytes())
        digest.update(bytes([episode.terminated, episode.truncated]))
    return digest.hexdigest()


def drawn_again(config: FromDemonstrations, folder: RunFolder, root: Path | None = None) -> Demos:
    """The demonstrations that the run in `folder` was begun with.

    Raises:
        UserError: the dataset is another one now, or the task cannot be started.
    """
    check_module(config.env_id, str(folder.path / "config.json"))
    if not (record := folder.path / RECORD).is_file():
        raise UserError(
            f"no file {record}, which says what the run learned from; train again with: irl train --config "
            f"{folder.path / 'config.json'} --out FOLDER"
        )
    before = files.read_json(record)
    demos = _drawn_of(config, root or config.datasets_root)
    now = drawn(demos)
    if isinstance(before, dict) and "sha256" not in before:
        # an older record
        del now["sha256"]
    if before != now:
        raise UserError(
            f"{config.demos} in {demos.path} is not the dataset of {record}, which the run was begun with; "
            f"name the folder that holds it with --datasets-root, or set MINARI_DATASETS_PATH"
        )
    return demos
