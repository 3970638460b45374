"""`irl evaluate`: the policy and the reward of a run in numbers, and one page to look at."""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
import tyro
from rich.console import Console

from irl.algorithms.probe import probe
from irl.algorithms.probe_make import STEPS
from irl.core import files, records
from irl.core.config import check_at_least, check_seed, from_json
from irl.core.errors import UserError
from irl.core.rng import episode_seeds
from irl.core.types import Episode
from irl.envs.rollouts import rollouts
from irl.experiment.boarded import board
from irl.experiment.cloned import evaluation_of_cloned
from irl.experiment.configs import BCRun, FromDemonstrations
from irl.experiment.draw import drawn_again
from irl.experiment.filmed import record
from irl.experiment.gate import broken, read_gate
from irl.experiment.judge import finite, judge_drift, judge_reward
from irl.experiment.probed import Asked, Named, probed
from irl.experiment.progress import each_episode, progress
from irl.experiment.references import NO_RETURN, references_of, why_unscored
from irl.experiment.snapshots import every_snapshot
from irl.policies.card import normalised_score, summary
from irl.policies.policy import Policy
from irl.report.folder import lookup
from irl.report.html import write_report
from irl.report.tables import evaluation_table

EVALUATION = "evaluation.json"
"""The one that the report shows."""


@dataclass(frozen=True)
class Evaluate:
    """Judge a run's policy and reward; writes evaluation.json and report.html into its folder."""

    run: tyro.conf.Positional[Path]
    """Run folder."""
    part: Literal["g", "f", "f-log-pi"] | None = None
    """Of AIRL's reward, judge this instead of g: writes evaluation-<part>.json, and no report."""
    average: bool = False
    """Judge, of each snapshot, the mean of its reward and of those before it, which is what `irl retrain
    --average` learns from: writes evaluation-average.json, and no report. Its health is of a mean, which was
    never a discriminator of anything."""
    episodes: int = 20
    """Episodes of the deterministic policy."""
    seed: int = 0
    """Draws episodes and probe; apart from every training seed."""
    datasets_root: Path | None = None
    """Folder of Minari datasets; that of the run unless given."""
    policies_root: Path | None = None
    """Where the shelf is; expert_data/policies unless given."""
    probe: Path | None = None
    """A probe made by `irl probe`; one is played unless given."""
    probe_steps: int = STEPS
    """Steps of each stratum of the probe that is played; numbers of other sizes do not compare."""
    also: tuple[Named, ...] = ()
    """Distances to give beside VAL."""
    gate: Path | None = None
    """TOML file of bounds (irl/experiment/gate.py says which); where one is broken the exit status is 1."""
    frames: int = 60
    """Pictures of an episode for the report, at most; 0 draws none."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "episodes", "probe_steps")
        check_at_least(self, 0, "frames")
        check_seed(self.seed)


def evaluate(command: Evaluate) -> None:
    """Evaluate, write, print; with a gate, see whether it is passed.

    Raises:
        SystemExit: 1, a bound of the gate is broken.
    """
    folder = records.open_run(command.run)
    # what is malformed is said before anything is played
    gate = None if command.gate is None else read_gate(command.gate)
    name = "-".join(filter(None, ("evaluation", "average" if command.average else None, command.part)))
    files.check_writable(target := folder.path / f"{name}.json")
    began = time.monotonic()
    result = evaluation(folder, command)
    files.write_json(target, result)
    console = Console()
    console.print(evaluation_table(result))
    if cost := result["drift"].get("cost"):
        asked = f"{cost['rewards']:,} rewards were asked for"
        if played := lookup(result, "cross_play.cost.steps"):
            asked += f", {played:,} steps played for cross-play"
        console.print(f"judged in {time.monotonic() - began:.0f} s; {asked}", highlight=False)
    said = f"written: {target}"
    if target.name == EVALUATION:
        board(folder.path, result["drift"])
        said = f"report: {write_report(folder.path)}"
    console.print(said, highlight=False, markup=False, soft_wrap=True)
    if lines := broken(gate, result) if gate else []:
        for line in lines:
            print(f"irl: {command.gate}: {line}", file=sys.stderr)
        raise SystemExit(1)


def evaluation(folder: records.RunFolder, command: Evaluate) -> dict[str, Any]:
    """The content of `evaluation.json`."""
    config = from_json(FromDemonstrations, folder.config, str(folder.path / "config.json"))
    if not (snapshots := folder.snapshots()):
        raise UserError(
            f"{folder.path} has no snapshot; go on with: irl train --resume {folder.path}, or where it is "
            f"finished, train again with: irl train --config {folder.path / 'config.json'} --out FOLDER"
        )
    torch.set_num_threads(config.threads)
    root = command.datasets_root or config.datasets_root
    demos = drawn_again(config, folder, root)
    references = references_of(config.env_id, demos, command.policies_root)
    if isinstance(config, BCRun):
        if command.part or command.average:
            raise UserError(f"{folder.path} is of bc, which learns no reward; leave --part and --average out")
        measure = lambda policy: _policy(_play(config.env_id, policy, command), references)  # noqa: E731
        return evaluation_of_cloned(folder, config, references, measure)
    # everything is read before anything is played
    policies, rewards = every_snapshot(config.env_id, snapshots, command.part, command.average)
    policy = policies[max(policies)]
    episodes = _play(config.env_id, policy, command)
    expert = demos.held_out or demos.episodes
    judged = probe(expert, episodes, config.env_id, command.seed)
    steps = list(snapshots)[-1]
    reward = judge_reward(rewards[steps], judged, command.seed)
    drift = judge_drift(rewards, judged)
    asked = Asked(command.probe, command.probe_steps, command.also, command.seed, command.policies_root)
    found = probed(config, demos, policies, rewards, asked)
    if not demos.held_out:
        reward["notes"].append("No demonstration is held out: the expert's steps are those trained on.")
    return {
        "format": "irl.evaluation",
        "version": 1,
        "run": folder.path.resolve().name,
        "method": config.KIND,
        "part": command.part,
        "average": command.average,
        "env_id": config.env_id,
        "env_steps": steps,
        "policy": _policy(episodes, references),
        "references": references,
        "reward": reward,
        "distances": found.distances,
        "terms": found.terms,
        "drift": {**drift, **found.drift},
        **found.trust,
        # the folder's pictures are those of the report
        "episodes": []
        if command.part or command.average
        else record(folder.path, config.env_id, episodes, rewards[steps], command.frames),
    }


def _play(env_id: str, policy: Policy, command: Evaluate) -> list[Episode]:
    seeds = episode_seeds(command.seed, "evaluation", command.episodes)
    with progress("evaluating", command.episodes) as report:
        return rollouts(env_id, policy, seeds, each_episode(report))


def _policy(episodes: Sequence[Episode], references: dict[str, Any]) -> dict[str, Any]:
    measured = summary(list(episodes))
    random, expert = references["random"], references["expert"]
    ends = (random["return_mean"] if random else None, expert["return_mean"] if expert else None)
    score = normalised_score(measured.return_mean, *ends)
    known = np.isfinite(measured.return_mean)
    unscored = why_unscored(measured.return_mean, *ends)
    return {
        "return_mean": finite(measured.return_mean),
        "return_mean_reason": None if known else NO_RETURN,
        "return_std": finite(measured.return_std),
        "return_min": finite(measured.return_min),
        "return_max": finite(measured.return_max),
        "normalised_score": finite(score),
        "normalised_score_reason": None if np.isfinite(score) else unscored,
        "episodes": measured.episodes,
        "length_mean": measured.length_mean,
        "length_min": measured.length_min,
        "returns": [finite(value) for value in measured.returns],
        "lengths": list(measured.lengths),
        "seeds": list(measured.episode_seeds),
    }
