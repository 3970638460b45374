"""What a recovered reward teaches where the dynamics are others: from random weights, frozen.

    python scripts/benchmarks/transferred.py runs/airl-hopper-s1 --dynamics mass=1.5 --extra=--average
    python scripts/benchmarks/transferred.py runs/airl-hopper-s1 --dynamics mass=1.5 --extra=--hand-written
    python scripts/benchmarks/transferred.py --table

Beside the fresh policies' returns by the hand-written reward stands the run's own policy, played there. The
second command makes the control: what the same learner makes of the hand-written reward there; truth.py
joins the two. One JSON a reward, run and dynamics; one that is there is not made again.
"""

import json
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

# beside this file
from judged import HAND_WRITTEN, reward_name
from methods import RESULTS, check_settings, irl

from irl.core.provenance import command_line
from irl.core.records import open_run

KEPT = (
    "snapshot",
    "part",
    "dynamics",
    "algorithm",
    "env_steps",
    "seeds",
    "returns",
    "beside",
    "random",
    "ratio",
)


@dataclass(frozen=True)
class Settings:
    """Which rewards go where."""

    runs: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Run folders."""
    dynamics: tuple[str, ...] = ("mass=1.5",)
    """As of `irl retrain`; all of them at once."""
    seeds: tuple[int, ...] = (1001,)
    """Of the fresh policies."""
    steps: int = 1_000_000
    """Environment steps of each."""
    extra: str = ""
    """More words for `irl retrain`; they are written into the result."""
    work: Path = Path("runs/transfer")
    """Where the new run folders are."""
    out: Path = RESULTS / "transfer"
    """Where the results go."""
    table: bool = False
    """Print what is there."""


def cell(settings: Settings, run: Path, reward: str, config: dict[str, Any]) -> dict[str, Any]:
    """Retrain there, and say what it came to: a row of `irl retrain --seeds`."""
    folder = settings.work / "-".join((reward, run.name, *settings.dynamics))
    given = ("--algo", "ppo", "--steps", str(settings.steps), "--out", str(folder))
    seeds = ("--seeds", *map(str, settings.seeds))
    words = shlex.split(settings.extra)
    irl("retrain", str(run), *seeds, "--dynamics", *settings.dynamics, *given, *words)
    row = json.loads((run / "retrained.json").read_text())["rows"][-1]
    environment = json.loads(next(folder.glob("*/environment.json")).read_text())
    return {
        "reward": reward,
        "run": run.name,
        "task": config["env_id"],
        **{name: row[name] for name in KEPT},
        "steps": settings.steps,
        "extra": settings.extra,
        "command": f"python scripts/benchmarks/{command_line()}",
        **{name: value for name, value in environment.items() if name != "command"},
    }


def _reward(settings: Settings, config: dict[str, Any]) -> str:
    words = shlex.split(settings.extra)
    if "--hand-written" in words:
        return HAND_WRITTEN
    part = words[words.index("--part") + 1] if "--part" in words else None
    return reward_name(config, {"method": config["kind"], "part": part, "average": "--average" in words})


def table(out: Path) -> str:
    """A line a reward and dynamics."""
    lines = ["| reward | task | dynamics | its own policy there | fresh policies |", "|---" * 5 + "|"]
    for file in sorted(out.glob("*.json")):
        found = json.loads(file.read_text())
        fresh = " ".join(f"{value:.0f}" for value in found["returns"])
        whose = f"{found['reward']} ({found['run'].rpartition('-')[2]})"
        lines.append(f"| {whose} | {found['task']} | {found['dynamics']} | {found['beside']:.0f} | {fresh} |")
    return "\n".join(lines)


def main(settings: Settings) -> None:
    """Every one that has no result yet, then the table."""
    for run in settings.runs:
        config = open_run(run).config
        reward = _reward(settings, config)
        # a control's reward does not say of which method's run it was
        whose = run.name if reward == HAND_WRITTEN else run.name.split("-", 1)[1]
        name = "-".join((reward, whose, *settings.dynamics))
        file = settings.out / f"{name.replace('=', '-')}.json"
        if file.is_file():
            check_settings(file, seeds=[*settings.seeds], steps=settings.steps, extra=settings.extra)
        else:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(cell(settings, run, reward, config), indent=1) + "\n")
    if settings.table:
        print(table(settings.out))


if __name__ == "__main__":
    main(tyro.cli(Settings))
