"""`irl train`: learn a policy and a reward from demonstrations."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import torch

from irl.algorithms.adversarial import Adversarial
from irl.algorithms.bc import BC
from irl.algorithms.interleaved import Interleaved
from irl.core import files, records
from irl.core.config import from_json, to_json
from irl.core.errors import UserError
from irl.core.provenance import command_line, environment
from irl.demos.load import Demos
from irl.discriminators.airl import AIRL
from irl.discriminators.ensemble import Ensemble
from irl.discriminators.gail import GAIL
from irl.envs.make import check_module
from irl.experiment import build
from irl.experiment.configs import (
    BCRun,
    ExpertRun,
    FromDemonstrations,
    Imitation,
    RetrainRun,
    untaught,
)
from irl.experiment.draw import RECORD, draw, drawn, drawn_again
from irl.experiment.play import Player
from irl.experiment.seeds import train_seeds
from irl.policies.policy import save_policy
from irl.rewards.artefact import save_reward
from irl.rewards.learned import RewardSpec
from irl.rewards.nets import SEES


@dataclass(frozen=True)
class Resume:
    """Go on with a run, or repeat one from its config.json."""

    resume: Path | None = None
    """Run folder to go on with, from its last checkpoint."""
    config: Path | None = None
    """A config.json to run again."""
    out: Path | None = None
    """Where the repeated run goes; needed with --config."""
    datasets_root: Path | None = None
    """Folder of Minari datasets, where it is not the one that the run was begun with."""


def train(config: FromDemonstrations) -> None:
    """Train a method into a new run folder, or one for each of several seeds."""
    if config.seeds:
        return train_seeds(config, train, lambda path: go_on(Resume(resume=path)))
    config = config.resolved()
    build.check_device(config.device)
    demos = draw(config)
    torch.set_num_threads(config.threads)
    assert config.out is not None
    made_by = environment(command_line(), config.device)
    folder = records.create(config.out, to_json(config), made_by, {RECORD: drawn(demos)})
    play(config, demos, folder)


def go_on(command: Resume) -> None:
    """Resume a run where its last checkpoint is, or start one again from its settings."""
    if (command.resume is None) == (command.config is None):
        raise UserError(
            "irl train takes a method (irl train gail ...), --resume RUN, or --config FILE --out FOLDER"
        )
    if command.config is not None:
        if command.out is None:
            raise UserError("--config repeats a run in a new folder: name it with --out FOLDER")
        config = from_json(FromDemonstrations, files.read_json(command.config), str(command.config))
        check_module(config.env_id, str(command.config))
        root = command.datasets_root or config.datasets_root
        return train(replace(config, out=command.out, datasets_root=root))
    assert command.resume is not None
    if command.out is not None:
        raise UserError(
            "--resume goes on in its own folder; leave --out away, or repeat the run with --config"
        )
    folder = records.open_run(command.resume)
    for kind, command_of in ((ExpertRun.KIND, "irl experts train"), (RetrainRun.KIND, "irl retrain")):
        if folder.config.get("kind") == kind:
            raise UserError(
                f"{folder.path} is a run of kind {kind!r}; go on with: {command_of} --resume {folder.path}"
            )
    config = from_json(FromDemonstrations, folder.config, str(folder.path / "config.json"))
    build.check_device(config.device)
    demos = drawn_again(config, folder, command.datasets_root)
    torch.set_num_threads(config.threads)
    return play(config, demos, folder)


def play(config: FromDemonstrations, demos: Demos, folder: records.RunFolder) -> None:
    """Train into `folder`, from its last checkpoint where it has one."""
    if isinstance(config, BCRun):
        algorithm = build.cloning(config, demos.episodes, demos.held_out)
        snapshot = _policy_of(algorithm)
    else:
        algorithm = build.imitation(config, demos.episodes)
        snapshot = partial(_snapshot, config, demos, algorithm)
    player = Player(
        algorithm,
        folder,
        config.watch,
        env_id=config.env_id,
        steps=config.steps,
        seed=config.seed,
        snapshot=snapshot,
    )
    player.run(to_go_on=f"irl train --resume {folder.path}")
    if not isinstance(config, BCRun) and (why := untaught(config.learner, config.steps)):
        print(f"irl: {why}", file=sys.stderr)
    print(f"trained; judge it with: irl evaluate {folder.path}", file=sys.stderr)


def _policy_of(algorithm: BC) -> Callable[[Path], None]:
    return lambda path: save_policy(algorithm.policy(), path / "policy.safetensors")


def _snapshot(config: Imitation, demos: Demos, algorithm: Adversarial | Interleaved, path: Path) -> None:
    """The policy, and the reward that the round just done was rewarded by; untrained at step 0."""
    learner, discriminator = algorithm.learner, algorithm.discriminator
    assert isinstance(discriminator, GAIL | AIRL | Ensemble)
    save_policy(learner.policy(), path / "policy.safetensors")
    spec = RewardSpec(
        env_id=config.env_id,
        method=config.KIND,
        reward_map=discriminator.reward_map,
        inputs=SEES[discriminator.net.spec.sees],
        net=discriminator.net.spec,
        gamma=config.learner.gamma,
        reward_scale=learner.reward_scale,
        env_steps=learner.env_steps,
        provenance=drawn(demos) | {"seed": config.seed},
    )
    save_reward(path / "reward", spec, discriminator.net)
