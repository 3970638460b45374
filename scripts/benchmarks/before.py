"""Steps a second of GAIL and DAC on HalfCheetah, at an earlier commit and now, at one set of settings.

    python scripts/benchmarks/before.py --turns 3

The two are run in turn, one thread each. Steps a second are those between the first report after the warm-up
and the last one, without evaluations. Writes results/before.json.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import methods
import tyro

from irl.core.provenance import command_line, environment

HERE = Path(__file__).resolve().parents[2]
TASK, WARM_UP = "HalfCheetah-v5", {"gail": 4096, "dac": 2000}
SETTINGS: dict[str, tuple[str, str, str]] = {
    "gail": (
        "gail --steps 40960",
        "--learner.n-envs 8 --learner.steps-per-round 2048 --learner.batch-size 64 --learner.n-epochs 10 "
        "--discriminator.hidden 100 100 --schedule.batch-size 256 --schedule.epochs 5",
        "",
    ),
    "dac-float32": (
        "dac --steps 4000",
        "--learner.learning-starts 1000 --learner.products float32",
        "--learner.quantiles 0",
    ),
    "dac-bfloat16": (
        "dac --steps 4000",
        "--learner.learning-starts 1000 --learner.products bfloat16",
        "--learner.quantiles 0",
    ),
}
"""Method and length, words for both, and words that the earlier commit does not know."""


@dataclass(frozen=True)
class Settings:
    """What is compared."""

    before: str = "4f9937a"
    """The earlier commit: the last one whose gradients were all autograd's."""
    turns: int = 3
    """Runs of each, in turn."""
    only: tuple[str, ...] = ()
    """Names of settings; all where none is given."""
    out: Path = Path(__file__).parent / "results" / "before.json"
    """The JSON to write."""


def speed(checkout: Path, words: list[str], out: Path, warm_up: int) -> float:
    """Steps a second of one run of `irl train` with the package of this checkout."""
    program = "from irl.experiment.cli import main; main()"
    quiet = ["--watch.eval-every", "1000000", "--watch.no-progress"]
    paths = {"PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", program, "train", *words, *quiet, "--out", str(out)]
    subprocess.run(command, cwd=checkout, env=os.environ | paths, check=True, capture_output=True)
    rows = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    first, last = next(row for row in rows if row["env_steps"] >= warm_up), rows[-1]
    return (last["env_steps"] - first["env_steps"]) / (last["wall_s"] - first["wall_s"])


def compared(settings: Settings, before: Path, folder: Path) -> dict[str, dict[str, list[float]]]:
    """Every turn's speed, by settings, then `before` and `now`."""
    methods.demonstrations(TASK, folder / "datasets")
    given = ["--env-id", TASK, "--demos", "irl/halfcheetah/expert-v0", "--demo-episodes", "5", "--seed", "1"]
    given += ["--datasets-root", str(folder / "datasets")]
    found: dict[str, dict[str, list[float]]] = {}
    for turn in range(settings.turns):
        for name in settings.only or SETTINGS:
            method, both, newer = (words.split() for words in SETTINGS[name])
            for when, checkout, more in (("before", before, []), ("now", HERE, newer)):
                words = [*method, *given, *both, *more]
                reached = speed(checkout, words, folder / f"{name}-{when}-{turn}", WARM_UP[method[0]])
                found.setdefault(name, {}).setdefault(when, []).append(reached)
                print(f"turn {turn + 1} {name:<13} {when:<7} {reached:8.1f} steps/s", flush=True)
    return found


def main(settings: Settings) -> None:
    """Check the earlier commit out beside this one, compare, write."""
    with tempfile.TemporaryDirectory() as temporary:
        before = Path(temporary) / "before"
        git = ("git", "-C", str(HERE), "worktree")
        subprocess.run([*git, "add", "--quiet", "--detach", str(before), settings.before], check=True)
        try:
            found = compared(settings, before, Path(temporary))
        finally:
            subprocess.run([*git, "remove", "--force", str(before)], check=True)
    medians = {
        name: {when: statistics.median(turns) for when, turns in of.items()} for name, of in found.items()
    }
    content = {
        "task": TASK,
        "before": settings.before,
        "turns": found,
        "steps_per_s": medians,
        "ratios": {name: of["now"] / of["before"] for name, of in medians.items()},
        **environment(f"python scripts/benchmarks/{command_line()}"),
    }
    settings.out.write_text(json.dumps(content, indent=1) + "\n")
    print(json.dumps(content["ratios"], indent=1))


if __name__ == "__main__":
    main(tyro.cli(Settings))
