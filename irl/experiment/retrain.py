"""`irl retrain`: a fresh policy on the frozen reward of a run, and its return by both rewards.

A reward that was learned beside a policy was good enough for that policy, along its own way. Whether it is a
reward is another question: what becomes of a policy that has seen neither demonstrations nor discriminator,
from random weights, on the reward as it stands. The learner sees the learned reward alone; observations are
normalised as the reward normalises them, by a copy that does not move. `--hand-written` is the
control: the task's own reward in its place.
"""

import re
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import torch
import tyro

from irl.core import records
from irl.core.config import MOST_SEED, check_at_least, check_seed, check_threads, from_json, to_json
from irl.core.errors import UserError
from irl.core.provenance import command_line, environment
from irl.envs.dynamics import named
from irl.envs.make import check_module
from irl.envs.names import full_name
from irl.envs.tasks import task_name
from irl.experiment import build
from irl.experiment.configs import (
    OFF_POLICY,
    OFF_POLICY_TD3,
    BCRun,
    Imitation,
    RetrainRun,
    check_learns,
    untaught,
)
from irl.experiment.frozen import RECORD, frozen, frozen_again, recorded
from irl.experiment.imitation_run import Watch, Words
from irl.experiment.play import Player
from irl.experiment.retrained import report
from irl.experiment.snapshots import snapshot_of
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig
from irl.learners.td3 import TD3Config
from irl.policies.policy import save_policy

Seeds = Annotated[tuple[int, ...], tyro.conf.arg(metavar="SEED ...")]
SEED_APART = 1000
"""The seed is that of the run and this, unless one is typed: no stream of the run is used again."""
LEARNERS = {settings.KIND: settings for settings in (PPOConfig(), OFF_POLICY, OFF_POLICY_TD3)}
"""The settings of each learner unless others are typed."""


@dataclass(frozen=True)
class Retrain:
    """Train a fresh policy on a run's frozen reward; writes retrain.json into a folder of its own."""

    run: tyro.conf.Positional[Path | None] = None
    """Run folder whose reward it is."""
    resume: Path | None = None
    """Run folder of `irl retrain` to go on with, by its own settings; no other is needed."""
    snapshot: int | None = None
    """Step of the snapshot; the last one unless given."""
    part: Literal["g", "f", "f-log-pi"] | None = None
    """Of AIRL's reward: g, what a step is worth; f, the same shaped by h; f-log-pi, which the run's learner
    may have been paid, with the snapshot's own policy. g unless given."""
    average: bool = False
    """The mean of the rewards of this snapshot and of those before it, the untrained one left out: of what a
    fresh policy does first, early ones know more than the last."""
    hand_written: bool = False
    """Learn from the task's own reward instead, all else as it is: what the same learner makes of that in as
    many steps is what a recovered reward is held against. The normaliser is the reward's, and PPO begins from
    the same weights; SAC and TD3 do where the reward knows no absorbing state. Where it does, the task's own
    pays nothing after a termination, so they lead none there, see one input less and draw other weights."""
    env_kwargs: Words = ()
    """Retrain where the task is another: what the environment is given beside what the run's was, name=value
    or a JSON object. Observations and actions must be of the same sizes."""
    dynamics: Words = ()
    """Retrain under other dynamics of a MuJoCo task: mass, gravity, friction or damping by a factor, e.g.
    gravity=0.5; disabled_legs=2 of the ant."""
    algo: Literal["ppo", "sac", "td3"] | None = None
    """Which learner; the run's own unless given."""
    steps: int | None = None
    """Environment steps; as many as the run's unless given."""
    seed: int | None = None
    """Seed of everything random; the run's + 1000 unless given."""
    seeds: Seeds = ()
    """Several, one after the other, each into a folder of its own, in --out where it is given. RUN's
    retrained.json then has their ratio to the policy beside the reward; what is done is not done again."""
    out: Path | None = None
    """Run folder; runs/retrain-<run>-<step>[-average][-<part>][-hand-written][-<task>]-<algo>-s<seed> unless
    given; the task where it is not the run's."""
    policies_root: Path | None = None
    """Where the shelf is, whose card gives the score; expert_data/policies unless given."""
    entropy: float = 0.0
    """What a nat of the fresh policy's own entropy pays beside the reward, in units of the reward. AIRL's is
    learned for a policy that is paid for it, at 1. Of PPO; SAC has its own."""
    ppo: PPOConfig = field(default_factory=PPOConfig)
    """How PPO learns; its own defaults, whatever the run had."""
    sac: SACConfig = OFF_POLICY
    """How SAC learns; its defaults for imitation, whatever the run had."""
    td3: TD3Config = OFF_POLICY_TD3
    """How TD3 learns, likewise."""
    watch: Watch = field(default_factory=Watch)
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the networks live."""
    threads: int = 1
    """Threads of torch's operators."""

    def __post_init__(self) -> None:
        check_threads(self.threads)
        if (self.run is None) == (self.resume is None):
            raise ValueError("name the run whose reward it is, or a run to go on with by --resume")
        if self.steps is not None:
            check_at_least(self, 1, "steps")
        check_at_least(self, 0, "entropy")
        for seed in (*self.seeds, *(() if self.seed is None else (self.seed,))):
            check_seed(seed)
        if self.hand_written and (self.part is not None or self.average):
            raise ValueError("--hand-written learns from no learned reward; leave --part and --average away")
        if self.seeds and (self.seed is not None or self.resume is not None):
            raise ValueError("--seeds begins or goes on with each of them; leave --seed and --resume away")
        if len(set(self.seeds)) < len(self.seeds):
            raise ValueError(f"--seeds {' '.join(map(str, self.seeds))} names one twice")


def retrain_one(command: Retrain) -> None:
    """Train with one seed, then measure by both rewards."""
    config, folder = _begun(command) if command.resume is None else _resumed(command)
    torch.set_num_threads(config.threads)
    reward = frozen_again(config, folder)
    algorithm = build.on_frozen(config, reward)
    player = Player(
        algorithm,
        folder,
        config.watch,
        env_id=config.env_id,
        steps=config.steps,
        seed=config.seed,
        snapshot=lambda path: save_policy(algorithm.learner.policy(), path / "policy.safetensors"),
        reward=reward,
    )
    player.run(to_go_on=f"irl retrain --resume {folder.path}")
    if why := untaught(config.learner, config.steps):
        print(f"irl: {why}", file=sys.stderr)
    report(config, folder, reward, command.policies_root)


def _begun(command: Retrain) -> tuple[RetrainRun, records.RunFolder]:
    """A new run folder; nothing is written before everything is read and the task is known to start."""
    assert command.run is not None
    source = records.open_run(command.run)
    if source.config.get("kind") == BCRun.KIND:
        raise UserError(f"{source.path} is of behavioural cloning, which learns no reward to retrain on")
    its = from_json(Imitation, source.config, str(source.path / "config.json"))
    check_module(its.env_id, str(source.path / "config.json"))
    build.check_device(command.device)
    step, snapshot = snapshot_of(source, command.snapshot)
    config = settled(command, its, step)
    reward = frozen(config, snapshot, command.part)
    check_learns(config.learner, config.steps)
    there = records.RunFolder(config.out)
    if (config.out / "config.json").is_file() and there.config.get("kind") == RetrainRun.KIND:
        raise UserError(
            f"{config.out} already holds a run; choose another folder with --out, or go on with it: "
            f"irl retrain --resume {config.out}"
        )
    made_by = environment(command_line(), config.device)
    record = {RECORD: recorded(config, reward, snapshot)}
    return config, records.create(config.out, to_json(config), made_by, record)


def settled(command: Retrain, its: Any, step: int) -> RetrainRun:
    """The settings, with what the run decides filled in.

    Args:
        its: the settings of the run.
        step: of the snapshot.
    Raises:
        UserError: they are of a learner that is not used, or the seed is the run's own.
    """
    assert command.run is not None
    algo = command.algo or its.learner.KIND
    for name, default in LEARNERS.items():
        if name != algo and getattr(command, name) != default:
            raise UserError(f"--{name}.* are settings of a learner that is not used; choose --algo {name}")
    if command.entropy and algo != PPOConfig.KIND:
        of_its_own = "; SAC's is --sac.ent-coef" if algo == SACConfig.KIND else ""
        raise UserError(f"--entropy is of PPO, and the learner is {algo.upper()}{of_its_own}")
    seed = (its.seed + SEED_APART) % (MOST_SEED + 1) if command.seed is None else command.seed
    if seed == its.seed:
        raise UserError(f"seed {seed} is the run's own; a fresh policy has other streams: choose another")
    source = command.run.resolve()
    env_id = full_name(its.env_id, (*command.env_kwargs, *named(command.dynamics)))
    of = ("-average" if command.average else "") + (f"-{command.part}" if command.part else "")
    of += "-hand-written" if command.hand_written else ""
    of += f"-{task_name(env_id)}" if env_id != its.env_id else ""
    return RetrainRun(
        run=source,
        snapshot=step,
        average=command.average,
        hand_written=command.hand_written,
        env_id=env_id,
        steps=its.steps if command.steps is None else command.steps,
        seed=seed,
        out=command.out or Path("runs") / f"retrain-{_called(source)}-{step}{of}-{algo}-s{seed}",
        learner=getattr(command, algo),
        entropy=command.entropy,
        watch=command.watch,
        device=command.device,
        threads=command.threads,
    )


def _called(run: Path) -> str:
    """What a run is called beside others: one of several seeds is s<seed>, as those of other methods are."""
    return f"{run.parent.name}-{run.name}" if re.fullmatch(r"s\d+", run.name) else run.name


def _resumed(command: Retrain) -> tuple[RetrainRun, records.RunFolder]:
    assert command.resume is not None
    folder = records.open_run(command.resume)
    if command != Retrain(resume=command.resume, policies_root=command.policies_root):
        raise UserError(
            f"--resume goes on by the settings of {folder.path}; leave the others away, or choose "
            f"another --out"
        )
    where = str(folder.path / "config.json")
    if (kind := folder.config.get("kind")) != RetrainRun.KIND:
        raise UserError(
            f"{folder.path} is a run of kind {kind!r:.40}; go on with: irl train --resume {folder.path}"
        )
    config = from_json(RetrainRun, {**folder.config, "out": str(folder.path)}, where)
    check_module(config.env_id, where)
    build.check_device(config.device)
    return config, folder
