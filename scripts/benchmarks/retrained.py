"""What a recovered reward teaches a policy that never met the discriminator: from random weights, frozen.

    python scripts/benchmarks/retrained.py dac --tasks Hopper-v5 --seeds 1 2 3
    python scripts/benchmarks/retrained.py airl --seeds 1 2 3 --shares 1.0 --extra=--hand-written --out OTHER

Takes the runs that methods.py left, their snapshots at these shares of the steps, fixed beforehand, and
trains a policy on each by `irl retrain`. Its seeds are none of the run's. The figure is the true return of
the policy at the last step, in 20 episodes. One JSON a cell; a cell whose JSON is there is not run again.
"""

import json
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

# beside this file
from judged import HAND_WRITTEN, reward_name
from methods import RESULTS, Method, begin_or_resume, check_settings

from irl.core.provenance import command_line
from irl.core.records import open_run
from irl.envs.tasks import task_name


@dataclass(frozen=True)
class Settings:
    """Which rewards are handed on."""

    method: Annotated[Method, tyro.conf.Positional]
    """Whose runs."""
    tasks: tuple[str, ...] = ("Hopper-v5",)
    """Gymnasium ids."""
    seeds: tuple[int, ...] = (1,)
    """Seeds of those runs."""
    shares: tuple[float, ...] = (0.5, 1.0)
    """Which snapshots: shares of a run's steps."""
    parts: tuple[str, ...] = ()
    """Of AIRL's reward: g, f, f-log-pi."""
    algo: Literal["ppo", "sac", "td3"] = "ppo"
    """Who learns."""
    steps: int = 500_000
    """Environment steps of the fresh policy."""
    extra: str = ""
    """More words for `irl retrain`; they are written into the result."""
    runs: Path = Path("runs/benchmarks")
    """Where the run folders are."""
    out: Path = RESULTS
    """Where the results go, as retrained/<method>/<task>-s<seed>-<snapshot>[-<part>].json."""


def cell(settings: Settings, run: Path, snapshot: int, part: str | None, name: str) -> dict[str, Any]:
    """Train on the frozen reward, or go on, and say what it came to."""
    folder = settings.runs / f"retrained-{settings.method}-{name}"
    words = ("--snapshot", str(snapshot), "--algo", settings.algo, "--steps", str(settings.steps))
    of = ("--part", part) if part else ()
    begin_or_resume("retrain", folder, str(run), *words, *of, *shlex.split(settings.extra))
    found = json.loads((folder / "retrain.json").read_text())
    beside = json.loads((run / "evaluation.json").read_text())["policy"]
    environment = json.loads((folder / "environment.json").read_text())
    words = shlex.split(settings.extra)
    said = {"method": settings.method, "part": part, "average": "--average" in words}
    return {
        "method": settings.method,
        "reward": HAND_WRITTEN if "--hand-written" in words else reward_name(open_run(run).config, said),
        "run": run.name,
        "snapshot": snapshot,
        "part": part,
        "algo": settings.algo,
        "steps": settings.steps,
        "env_steps": found["env_steps"],
        "seed": found["seed"],
        "score": found["true"]["normalised_score"],
        "return_mean": found["true"]["return_mean"],
        "return_std": found["true"]["return_std"],
        "learned_return_mean": found["learned"]["return_mean"],
        "score_of_the_run": beside["normalised_score"],
        "extra": settings.extra,
        "command": f"python scripts/benchmarks/{command_line()}",
        **{k: v for k, v in environment.items() if k != "command"},
    }


def main(settings: Settings) -> None:
    """Every cell that has no result yet; print and write each."""
    for task in settings.tasks:
        for seed in settings.seeds:
            run = settings.runs / f"{settings.method}-{task_name(task)}-s{seed}"
            there = list(open_run(run).snapshots())
            for share in settings.shares:
                snapshot = min(there, key=lambda step: abs(step - share * there[-1]))
                for part in settings.parts or (None,):
                    name = "-".join([task_name(task), f"s{seed}", str(snapshot), *([part] if part else [])])
                    file = settings.out / "retrained" / settings.method / f"{name}.json"
                    if file.is_file():
                        asked = {"steps": settings.steps, "extra": settings.extra}
                        check_settings(file, algo=settings.algo, **asked)
                        print(f"{file} is there", flush=True)
                        continue
                    row = cell(settings, run, snapshot, part, name)
                    file.parent.mkdir(parents=True, exist_ok=True)
                    file.write_text(json.dumps(row, indent=1) + "\n")
                    shown = ("run", "snapshot", "part", "score", "return_mean", "score_of_the_run")
                    print(json.dumps({key: row[key] for key in shown}), flush=True)


if __name__ == "__main__":
    main(tyro.cli(Settings))
