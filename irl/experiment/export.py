"""`irl export`: a policy as a file that another library reads."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro
from gymnasium.spaces import Box
from rich.console import Console

from irl.core import files
from irl.core.errors import UserError
from irl.core.records import open_run
from irl.envs.discrete import OneHot
from irl.envs.make import check_module, make
from irl.experiment.snapshots import snapshot_of
from irl.learners.sb3_export import ALGORITHMS, sb3_zip
from irl.policies import shelf
from irl.policies.policy import Policy, check_policy, load_policy


@dataclass(frozen=True)
class Export:
    """Write a policy as a Stable-Baselines3 zip.

    PPO.load, SAC.load or TD3.load reads it where irl is installed, and predicts what the policy does. Value
    network and critics in it are random and untrained: a saved policy has none.
    """

    run: tyro.conf.Positional[Path]
    """Run folder of any kind, or the folder of a policy on the shelf."""
    format: Literal["sb3"] = "sb3"
    """What to write."""
    out: Path | None = None
    """The file; sb3-<step>.zip in the run folder unless given."""
    snapshot: int | None = None
    """Step of the snapshot; the last one unless given."""
    overwrite: bool = False
    """Replace a file that is there."""


def export(command: Export) -> None:
    """Read the policy, write the file, say what is in it."""
    source, out = _places(command)
    if out.is_dir() or (out.exists() and not command.overwrite):
        hint = "choose another file with --out" + ("" if out.is_dir() else ", or replace it by --overwrite")
        raise UserError(f"{out} is there already; {hint}")
    files.check_writable(out)
    policy = load_policy(source)
    files.write_bytes(out, _zip(policy, source))
    algorithm = ALGORITHMS[policy.spec.distribution]
    untrained = "the value network" if algorithm.__name__ == "PPO" else "the critics"
    Console().print(
        f"wrote {out}: stable_baselines3.{algorithm.__name__}.load reads it where irl is installed; "
        f"{untrained} in it: random, untrained",
        highlight=False,
        markup=False,
        soft_wrap=True,
    )


def _places(command: Export) -> tuple[Path, Path]:
    """Where the policy is, and where the zip goes."""
    on_shelf = command.run / shelf.POLICY
    if on_shelf.is_file() and not (command.run / "config.json").is_file():
        if command.snapshot is not None:
            raise UserError(f"{command.run} is one policy, not a run; leave --snapshot away")
        if command.out is None:
            raise UserError(f"{command.run} is not a run folder; name the file with --out FILE.zip")
        return on_shelf, command.out
    folder = open_run(command.run)
    step, snapshot = snapshot_of(folder, command.snapshot)
    return snapshot / shelf.POLICY, command.out or folder.path / f"sb3-{step:09d}.zip"


def _zip(policy: Policy, source: Path) -> bytes:
    """The zip, with the spaces of the policy's own task."""
    check_module(policy.spec.env_id, str(source))
    env = make(policy.spec.env_id)
    try:
        check_policy(policy, env)
        observations, actions = env.observation_space, env.action_space
    finally:
        env.close()
    assert isinstance(observations, Box)
    assert isinstance(actions, Box)
    try:
        return sb3_zip(policy, observations, actions.choices if isinstance(actions, OneHot) else actions)
    except ValueError as error:
        raise UserError(f"{source} cannot be a zip of Stable-Baselines3: {error}") from error
