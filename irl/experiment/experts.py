"""`irl experts train`: a policy trained on a task's own reward, measured, put on the shelf."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import torch
from rich.console import Console

from irl.core import records
from irl.core.config import check_at_least, check_seed, check_threads, from_json, to_json
from irl.core.differences import differences, without
from irl.core.errors import UserError
from irl.core.provenance import command_line, environment, versions
from irl.envs.make import check_module, make
from irl.envs.names import full_name
from irl.envs.tasks import task_name
from irl.experiment import build
from irl.experiment.configs import ExpertRun, check_learns
from irl.experiment.imitation_run import Watch, Words
from irl.experiment.play import MAY_CHANGE, Player
from irl.experiment.recipes import recipe
from irl.experiment.shelved import EPISODES, Row, measured_of, shelf_table
from irl.policies import shelf
from irl.policies.card import Card, measure_random
from irl.policies.policy import Policy, load_policy, save_policy


@dataclass(frozen=True)
class TrainExpert:
    """Train a policy on the task's own reward and put it on the shelf.

    Without other flags this repeats the recipe of the shipped expert.
    """

    env_id: str = ""
    """Gymnasium id of the task."""
    env_kwargs: Words = ()
    """What the environment is given, name=value or a JSON object."""
    resume: Path | None = None
    """Run folder to go on with, by its own settings; no other is needed."""
    algo: Literal["ppo", "sac"] | None = None
    """Which learner; that of the shipped expert, or PPO for a task without one, unless given."""
    steps: int | None = None
    """Environment steps; the recipe's unless given."""
    seed: int = 0
    """Seed of everything random."""
    level: str = "expert"
    """Name of the level on the shelf; `medium` has recipes of its own, about a third of the way."""
    out: Path | None = None
    """Run folder; runs/<level>-<task>-<algo>-s<seed> unless given. A run that is there goes on."""
    policies_root: Path | None = None
    """Where the shelf is; expert_data/policies unless given."""
    overwrite: bool = False
    """Replace a policy that is on the shelf already; otherwise the new one stays in the run folder."""
    watch: Watch = dataclasses.field(default_factory=lambda: Watch(eval_every=50))
    threads: int = 1
    """Threads of torch's operators."""

    def __post_init__(self) -> None:
        check_threads(self.threads)
        check_seed(self.seed)
        shelf.check_level(self.level)
        if not self.env_id and self.resume is None:
            raise ValueError("name the task with --env-id, or a run to go on with by --resume")
        if self.steps is not None:
            check_at_least(self, 1, "steps")


def train(command: TrainExpert) -> None:
    """Train, measure, write policy and card into the run folder, and shelve them.

    Raises:
        UserError: the place on the shelf is another task's, or the settings do not go together.
    """
    run = _resumed(command) if command.resume is not None else _expert_run(command)
    shelf.check_place(_place(run, command), run.env_id)
    env = make(run.env_id)
    try:
        build.check_learner(run.learner.KIND, env)
    finally:
        env.close()
    torch.set_num_threads(run.threads)
    folder = _open_or_create(run)
    algorithm = build.forward(run)
    player = Player(
        algorithm,
        folder,
        run.watch,
        env_id=run.env_id,
        steps=run.steps,
        seed=run.seed,
        snapshot=lambda path: save_policy(algorithm.learner.policy(), path / shelf.POLICY),
    )
    player.run(to_go_on=f"irl experts train --resume {folder.path}")
    steps, last = list(folder.snapshots().items())[-1]
    _shelve(run, load_policy(last / shelf.POLICY), steps, folder.metrics()[-1]["wall_s"], command)


def _resumed(command: TrainExpert) -> ExpertRun:
    assert command.resume is not None
    folder = records.open_run(command.resume)
    if command != TrainExpert(
        resume=command.resume, overwrite=command.overwrite, policies_root=command.policies_root
    ):
        raise UserError(
            f"--resume goes on by the settings of {folder.path}; leave the others away, or choose "
            f"another --out"
        )
    if (kind := folder.config.get("kind")) != ExpertRun.KIND:
        raise UserError(
            f"{folder.path} is a run of kind {kind!r}; go on with: irl train --resume {folder.path}"
        )
    where = str(folder.path / "config.json")
    run = from_json(ExpertRun, {**folder.config, "out": str(folder.path)}, where)
    check_module(run.env_id, where)
    return run


def _expert_run(command: TrainExpert) -> ExpertRun:
    env_id = full_name(command.env_id, command.env_kwargs)
    algo, chosen = recipe(env_id, command.algo, command.level)
    task = task_name(env_id)
    run = ExpertRun(
        env_id=env_id,
        level=command.level,
        steps=chosen.steps if command.steps is None else command.steps,
        seed=command.seed,
        out=command.out or Path("runs") / f"{command.level}-{task}-{algo}-s{command.seed}",
        learner=chosen.learner,
        watch=command.watch,
        device="cpu",
        threads=command.threads,
    )
    check_learns(run.learner, run.steps)
    return run


def _open_or_create(run: ExpertRun) -> records.RunFolder:
    config = to_json(run)
    if (run.out / "config.json").is_file():
        folder = records.open_run(run.out)
        if changed := differences(without(folder.config, MAY_CHANGE), without(config, MAY_CHANGE)):
            raise UserError(
                f"{run.out} holds a run with other settings: {'; '.join(changed)}. Choose another --out, or "
                f"go on with that run: irl experts train --resume {run.out}"
            )
        return folder
    return records.create(run.out, config, environment(command_line(), run.device))


def _place(run: ExpertRun, command: TrainExpert) -> Path:
    """Where on the shelf the policy goes."""
    return shelf.writable_root(command.policies_root) / task_name(run.env_id) / run.level


def _shelve(run: ExpertRun, policy: Policy, steps: int, train_s: float, command: TrainExpert) -> None:
    console = Console()
    measured = measured_of(run.env_id, policy, EPISODES, 0)
    random = measure_random(run.env_id)
    card = Card(
        env_id=run.env_id,
        level=run.level,
        algorithm=run.learner.KIND,
        steps=steps,
        seed=run.seed,
        measured=measured,
        random_return_mean=random.return_mean,
        random_return_std=random.return_std,
        settings=to_json(run.learner),
        versions=versions(),
        command=command_line(),
        train_s=train_s,
    )
    shelf.write(run.out / "policy", policy, card)
    console.print(shelf_table([Row(card, measured, run.out / "policy")]))
    # once more: another training may have come first
    shelf.check_place(place := _place(run, command), run.env_id)
    if (place / shelf.CARD).is_file() and not command.overwrite:
        console.print(f"{place} holds a policy already; kept. The new one is in {run.out / 'policy'}")
        return
    shelf.write(place, policy, card)
    console.print(f"shelved as {place}")
