"""`irl probe`: the steps that rewards of a task are judged on, in a file."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from irl.algorithms.probe_file import load_probe, save_probe
from irl.algorithms.probe_make import STEPS, at_shares, base_probe, own_strata
from irl.algorithms.probe_set import BASE, ProbeSet
from irl.core import files, records
from irl.core.config import check_at_least, from_json
from irl.core.errors import UserError
from irl.core.types import Episode
from irl.envs.make import check_module, make
from irl.envs.names import full_name, split_name
from irl.envs.tasks import task_name
from irl.experiment.configs import FromDemonstrations
from irl.experiment.imitation_run import Words
from irl.experiment.progress import each_step, progress
from irl.policies import shelf
from irl.policies.policy import Policy, check_policy, load_policy


@dataclass(frozen=True)
class Probe:
    """Make the steps that rewards of a task are judged on; writes one .npz, readable without irl."""

    run: tyro.conf.Positional[Path | None] = None
    """Run folder: its own policies become strata beside the base ones."""
    env_id: str | None = None
    """Gymnasium id of the task; that of the run unless given."""
    env_kwargs: Words = ()
    """What the environment is given, name=value or a JSON object; becomes part of env_id."""
    steps: int = STEPS
    """Steps of each stratum. Probes of other sizes are other probes: their numbers do not compare."""
    out: Path | None = None
    """File; probes/<task>.npz, or the run's probe.npz, unless given."""
    policies_root: Path | None = None
    """Where the shelf is; expert_data/policies unless given."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "steps")


def make_probe(command: Probe) -> None:
    """Play, write, print."""
    folder = None if command.run is None else records.open_run(command.run)
    env_id = _task(command, folder)
    out = command.out or (
        folder.path / "probe.npz" if folder else Path("probes") / f"{task_name(env_id)}.npz"
    )
    files.check_writable(out)
    probe = base_of(env_id, command.policies_root, (), command.steps)
    if folder is not None:
        own = own_of(env_id, policies_of(env_id, folder.snapshots()), command.steps)
        probe = ProbeSet(env_id, {**probe, **own}, {**probe.about, **own.about})
    save_probe(probe, out)
    console = Console()
    for name, episodes in probe.items():
        mean = sum(episode.return_ for episode in episodes) / len(episodes)
        sizes = f"{sum(map(len, episodes)):>6} steps, {len(episodes):>3} episodes, return {mean:10.1f}"
        console.print(
            f"{name:<14} {sizes}   {probe.about[name]}", highlight=False, markup=False, soft_wrap=True
        )
    console.print(f"{out}: base {probe.base_sha256[:16]}", highlight=False, markup=False, soft_wrap=True)


def base_of(env_id: str, policies_root: Path | None, held_out: Sequence[Episode], steps: int) -> ProbeSet:
    """The base probe of a task, played now.

    Raises:
        UserError: the shelf has no expert of it, and no demonstration is held out.
    """
    expert, medium = (_shelved(env_id, level, policies_root) for level in ("expert", "medium"))
    if expert is None and not held_out:
        raise UserError(
            f"a probe needs play of an expert, and the shelf has none of {env_id}; train one with: irl "
            f"experts train --env-id {env_id}"
        )
    total = len(BASE) * steps
    with progress("probe", total) as report:
        return base_probe(env_id, expert, medium, held_out, steps, each_step(report, total))


def own_of(env_id: str, policies: Mapping[int, Policy], steps: int) -> ProbeSet:
    """Strata of a run's policies, by step, at 0, 25, 50, 75 and 100 % of it, played now."""
    shown = {share: policies[step] for share, step in at_shares(list(policies)).items()}
    total = len(shown) * steps
    with progress("the run's policies", total) as report:
        return own_strata(env_id, shown, steps, each_step(report, total))


def policies_of(env_id: str, snapshots: Mapping[int, Path]) -> dict[int, Policy]:
    """The policy of each snapshot, by step.

    Raises:
        UserError: there is none, or one is damaged or of another task.
    """
    if not snapshots:
        raise UserError("the run has no snapshot yet; its policies are taken as it goes on")
    policies = {step: load_policy(path / "policy.safetensors") for step, path in snapshots.items()}
    env = make(env_id)
    try:
        for policy in policies.values():
            check_policy(policy, env)
    finally:
        env.close()
    return policies


def given(path: Path, env_id: str) -> ProbeSet:
    """A probe that was made before.

    Raises:
        UserError: it is of another task.
    """
    probe = load_probe(path)
    if probe.env_id != env_id:
        raise UserError(f"{path} is a probe of {probe.env_id}, the run is of {env_id}; give one of that task")
    return probe


def _task(command: Probe, folder: records.RunFolder | None) -> str:
    if folder is None:
        if command.env_id is None:
            raise UserError("no task is named; give --env-id, e.g. --env-id Hopper-v5, or a run folder")
        return full_name(command.env_id, command.env_kwargs)
    where = str(folder.path / "config.json")
    env_id = from_json(FromDemonstrations, folder.config, where).env_id
    check_module(env_id, where)
    if command.env_id is None and command.env_kwargs:
        raise UserError(
            f"{folder.path} is a run of {env_id}; leave --env-kwargs out, or make a probe of another task "
            f"without a run: irl probe --env-id {split_name(env_id)[0]} --env-kwargs "
            f"{shlex.join(command.env_kwargs)}"
        )
    if command.env_id is not None and full_name(command.env_id, command.env_kwargs) != env_id:
        raise UserError(f"{folder.path} is a run of {env_id}; leave --env-id out")
    return env_id


def _shelved(env_id: str, level: str, root: Path | None) -> Policy | None:
    known = {(card.env_id, card.level) for card in shelf.cards(root)}
    return shelf.find(env_id, level, root).policy if (env_id, level) in known else None
