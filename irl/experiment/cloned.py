"""What `irl evaluate` says of behavioural cloning, which leaves a policy and no reward."""

from collections.abc import Callable
from typing import Any

from irl.core.records import RunFolder
from irl.envs.make import make
from irl.experiment.configs import BCRun
from irl.policies.policy import Policy, check_policy, load_policy

NO_REWARD = "behavioural cloning learns no reward, so there is none to judge"


def evaluation_of_cloned(
    folder: RunFolder,
    config: BCRun,
    references: dict[str, Any],
    measure: Callable[[Policy], dict[str, Any]],
) -> dict[str, Any]:
    """The content of `evaluation.json` for the last snapshot; `measure` plays its policy.

    Raises:
        UserError: the policy is missing, damaged or of another task.
    """
    steps, snapshot = max(folder.snapshots().items())
    policy = load_policy(snapshot / "policy.safetensors")
    env = make(config.env_id)
    try:
        check_policy(policy, env)
    finally:
        env.close()
    return {
        "format": "irl.evaluation",
        "version": 1,
        "run": folder.path.resolve().name,
        "method": config.KIND,
        "env_id": config.env_id,
        "env_steps": steps,
        "policy": measure(policy),
        "references": references,
        "reward": {"notes": [NO_REWARD]},
        "distances_reason": NO_REWARD,
        "drift": {"changes_reason": NO_REWARD},
    }
