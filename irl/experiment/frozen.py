"""Which reward a policy is retrained on: read once, written down, and the same ever after."""

from pathlib import Path
from typing import Any

import gymnasium as gym
from gymnasium.spaces import Box

from irl.core import files
from irl.core.differences import without
from irl.core.errors import UserError
from irl.core.records import RunFolder, open_run
from irl.envs.discrete import OneHot
from irl.envs.make import make
from irl.envs.names import split_name
from irl.experiment.build import check_learner
from irl.experiment.configs import RetrainRun
from irl.experiment.snapshots import snapshot_of
from irl.rewards.artefact import WEIGHTS, load_reward
from irl.rewards.averaged import averaged, so_far
from irl.rewards.learned import LearnedReward
from irl.rewards.shaped import ENTROPIC, PARTS

RECORD = "reward.json"
"""Says in the run folder which reward it is."""


def frozen(config: RetrainRun, snapshot: Path, part: str | None = None) -> LearnedReward:
    """The reward of a snapshot, a `part` or an average of it, once it is known to be of a task that starts.

    Raises:
        UserError: it is missing, damaged, or of another task; or the task cannot be started.
    """
    place, reward = snapshot / "reward", _read(config, snapshot, part)
    env = make(config.env_id)
    try:
        takes = reward.spec.net.obs_dim, reward.spec.net.action_dim
        needs = _size(env.observation_space), _size(box := env.action_space)
        # the same task under other dynamics is what a reward may be taken to
        same = split_name(reward.spec.env_id)[0] == split_name(config.env_id)[0]
        if not same or takes != needs:
            raise UserError(
                f"the reward in {place} is of {reward.spec.env_id} with observations of {takes[0]} and "
                f"actions of {takes[1]}; {config.env_id} has {needs[0]} and {needs[1]}: choose the run it "
                f"belongs to"
            )
        check_learner(config.learner.KIND, env)
        if config.entropy and isinstance(env.action_space, OneHot):
            raise UserError(
                f"--entropy pays the density of real-valued actions, and {config.env_id} has a choice of "
                f"{needs[1]}; use PPO's own bonus: --ppo.ent-coef {config.entropy}"
            )
        env.reset(seed=config.seed)
        assert isinstance(box, Box)
        env.step(((box.low + box.high) / 2).astype(box.dtype))
        return reward
    finally:
        env.close()


def _read(config: RetrainRun, snapshot: Path, part: str | None) -> LearnedReward:
    if not config.average:
        return load_reward(snapshot / "reward", part)
    return averaged([load_reward(path / "reward", part) for path in _averaged_over(config).values()])


def _averaged_over(config: RetrainRun) -> dict[int, Path]:
    """The snapshots that the average is of."""
    return so_far(open_run(config.run).snapshots(), config.snapshot)


def recorded(config: RetrainRun, reward: LearnedReward, snapshot: Path) -> dict[str, Any]:
    """What is written down of it."""
    spec = reward.spec
    over = _averaged_over(config) if config.average else {}
    digests = {str(steps): _digest(path) for steps, path in over.items()}
    return {
        "run": config.run.name,
        "env_steps": config.snapshot,
        "method": spec.method,
        "reward_map": spec.reward_map,
        "absorbing_scale": spec.net.absorbing_scale,
        "gamma": spec.gamma,
        "weights_sha256": _digest(snapshot),
        **({"average_over": digests} if config.average else {}),
        **({"hand_written": True} if config.hand_written else {}),
    }


def is_recorded(before: object, now: dict[str, Any]) -> bool:
    """Whether a reward.json is of this reward; the run that it came from may have another name by now."""
    return isinstance(before, dict) and without(before, ("run",)) == without(now, ("run",))


def _digest(snapshot: Path) -> str:
    return files.sha256(snapshot / "reward" / WEIGHTS)


def frozen_again(config: RetrainRun, folder: RunFolder) -> LearnedReward:
    """The reward that the run in `folder` was begun with.

    Raises:
        UserError: it is gone, or another one now.
    """
    if not (config.run / "config.json").is_file():
        raise UserError(
            f"{config.run}, whose reward {folder.path} learns from, is not there; put it back, or write its "
            f"new place into {folder.path / 'config.json'} as run"
        )
    _, snapshot = snapshot_of(open_run(config.run), config.snapshot)
    before = files.read_json(record := folder.path / RECORD)
    paid = before.get("reward_map") if isinstance(before, dict) else None
    reward = frozen(config, snapshot, paid if paid in (*PARTS, ENTROPIC) else None)
    if not is_recorded(before, recorded(config, reward, snapshot)):
        raise UserError(
            f"{snapshot / 'reward'} is not the reward of {record}, which the run was begun with; put that "
            f"back, or begin again with another --out"
        )
    return reward


def _size(space: gym.Space) -> int:
    # `make` admits flat boxes only
    return space.shape[0] if space.shape else 0
