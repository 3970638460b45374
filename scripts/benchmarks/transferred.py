"""What a recovered reward teaches where the dynamics are others: from random weights, frozen.

    python scripts/benchmarks/transferred.py runs/airl-hopper-s1 --dynamics mass=1.5 --extra=--average
    python scripts/benchmarks/transferred.py --table

Beside the fresh policies' returns by the hand-written reward stand the run's own policy, played there, and
what the same learner makes of the hand-written reward there with as many steps (`irl retrain
--hand-written`). One JSON a run and dynamics; one that is there is not made again.
"""

import json
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

# beside this file
from judged import reward_name
from methods import RESULTS, irl

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


def taught(settings: Settings, run: Path, words: list[str]) -> tuple[dict[str, Any], Path]:
    """Fresh policies there, the row of `irl retrain --seeds` and where their folders are."""
    of = [word.strip("-") for word in words if word in ("--average", "--hand-written")]
    folder = settings.work / "-".join([run.name, *settings.dynamics, *of])
    given = ["--algo", "ppo", "--steps", str(settings.steps), "--out", str(folder)]
    seeds = ["--seeds", *map(str, settings.seeds)]
    irl("retrain", str(run), *seeds, "--dynamics", *settings.dynamics, *given, *words)
    return json.loads((run / "retrained.json").read_text())["rows"][-1], folder


def cell(settings: Settings, run: Path, config: dict[str, Any]) -> dict[str, Any]:
    """Retrain there, and say what it came to."""
    words = shlex.split(settings.extra)
    row, folder = taught(settings, run, words)
    # the same learner's words without what chooses the reward
    part = words.index("--part") if "--part" in words else len(words)
    learner = [word for i, word in enumerate(words) if word != "--average" and i not in (part, part + 1)]
    truth, _ = taught(settings, run, [*learner, "--hand-written"])
    environment = json.loads(next(folder.glob("*/environment.json")).read_text())
    return {
        "reward": _reward(settings, config),
        "run": run.name,
        "task": config["env_id"],
        **{name: row[name] for name in KEPT},
        "truth": truth["returns"],
        "extra": settings.extra,
        "command": f"python scripts/benchmarks/{command_line()}",
        **{name: value for name, value in environment.items() if name != "command"},
    }


def _averages(settings: Settings) -> bool:
    return "--average" in shlex.split(settings.extra)


def _reward(settings: Settings, config: dict[str, Any]) -> str:
    words = shlex.split(settings.extra)
    part = words[words.index("--part") + 1] if "--part" in words else None
    return reward_name(config, {"method": config["kind"], "part": part, "average": _averages(settings)})


def table(out: Path) -> str:
    """A line a reward and dynamics."""
    lines = ["| reward | task | dynamics | its own policy there | fresh policies | PPO on the hand-written |"]
    lines.append("|---" * 6 + "|")
    for file in sorted(out.glob("*.json")):
        found = json.loads(file.read_text())
        fresh, true = (" ".join(f"{value:.0f}" for value in found[name]) for name in ("returns", "truth"))
        whose = f"{found['reward']} ({found['run'].rpartition('-')[2]})"
        lines.append(
            f"| {whose} | {found['task']} | {found['dynamics']} | {found['beside']:.0f} | {fresh} | {true} |"
        )
    return "\n".join(lines)


def main(settings: Settings) -> None:
    """Every one that has no result yet, then the table."""
    for run in settings.runs:
        config = open_run(run).config
        name = "-".join((_reward(settings, config), run.name.split("-", 1)[1], *settings.dynamics))
        file = settings.out / f"{name.replace('=', '-')}.json"
        if not file.is_file():
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(cell(settings, run, config), indent=1) + "\n")
    if settings.table:
        print(table(settings.out))


if __name__ == "__main__":
    main(tyro.cli(Settings))
