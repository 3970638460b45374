"""Which snapshot of a run a command is about: the last one, the one whose step is typed, or all, read."""

from collections.abc import Mapping
from pathlib import Path

from irl.core.errors import UserError
from irl.core.records import RunFolder
from irl.envs.make import make
from irl.policies.policy import Policy, check_policy, load_policy
from irl.rewards.artefact import load_reward
from irl.rewards.averaged import averaged, so_far
from irl.rewards.learned import LearnedReward


def snapshot_of(folder: RunFolder, step: int | None) -> tuple[int, Path]:
    """The environment steps and the folder of the snapshot of `step`, of the last one where it is None.

    Raises:
        UserError: there is none.
    """
    if not (snapshots := folder.snapshots()):
        raise UserError(f"{folder.path} has no snapshot yet; a run takes them as it goes on")
    if step is None:
        step = max(snapshots)
    if step not in snapshots:
        there = ", ".join(map(str, snapshots))
        raise UserError(f"{folder.path} has no snapshot of step {step}; choose one of --snapshot {there}")
    return step, snapshots[step]


def every_snapshot(
    env_id: str, snapshots: Mapping[int, Path], part: str | None, average: bool = False
) -> tuple[dict[int, Policy], dict[int, LearnedReward]]:
    """The policy and the reward, or a part of it, of each snapshot.

    Args:
        average: whether each reward is the mean of those so far, as of `irl.rewards.averaged`.
    Raises:
        UserError: a file is missing or damaged, or of another task, or there is no such part or average.
    """
    policies = {steps: load_policy(path / "policy.safetensors") for steps, path in snapshots.items()}
    rewards = {steps: load_reward(path, part) for steps, path in snapshots.items()}
    env = make(env_id)
    try:
        for steps, reward in rewards.items():
            check_policy(policies[steps], env)
            _check_reward(reward, env_id, policies[steps], snapshots[steps])
    finally:
        env.close()
    if average:
        rewards = {at: averaged(list(so_far(rewards, at).values())) for at in rewards}
    return policies, rewards


def _check_reward(reward: LearnedReward, env_id: str, policy: Policy, path: Path) -> None:
    takes = reward.spec.net.obs_dim, reward.spec.net.action_dim
    needs = policy.spec.obs_dim, policy.spec.action_dim
    if reward.spec.env_id != env_id or takes != needs:
        raise UserError(
            f"the reward in {path / 'reward'} is of {reward.spec.env_id} with observations of {takes[0]} and "
            f"actions of {takes[1]}; {env_id} has {needs[0]} and {needs[1]}: take the snapshot away, or "
            f"choose the run it belongs to"
        )
