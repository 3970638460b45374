"""One small grid twice: by processes here, and on a Ray cluster of two workers of which one is killed.

    python scripts/ray_and_kill.py

The worker of a cell gets SIGKILL when half of its steps are done. Both must complete, and every number but
those of the clock must be the same. Needs Ray: `pip install 'irl[ray]'`.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from irl.bench.cells import expand
from irl.bench.grid import read_grid

CLOCK = ("wall_s", "curve_s")
GRID = """
title = "GAIL and cloning on Hopper, as short as they go"
seeds = [21, 22]
tasks = ["Hopper-v5"]
demos = [4]
evaluate = "--episodes 3 --probe-steps 500"

[[part]]
methods = ["gail"]
steps = {steps}
settings = {{ "watch.eval-every" = 2, "watch.checkpoint-every-s" = 0.0, "watch.tensorboard" = false }}

[[part]]
methods = ["bc"]
steps = 1000
seeds = [21]
"""


@dataclass(frozen=True)
class Settings:
    """How much of it."""

    steps: int = 20_480
    """Environment steps of each run of GAIL."""
    wait_s: float = 900.0
    """Longest time until the cell that is killed is half-way."""


def bench(grid: Path, folder: Path, name: str, *words: str) -> subprocess.Popen[bytes]:
    """Start the grid in a folder of its own."""
    where = ("--runs", str(folder / name / "runs"), "--results", str(folder / name / "results"))
    program = "from irl.experiment.cli import main; main()"
    data = ("--datasets-root", str(folder / "datasets"), "--workers", "2")
    return subprocess.Popen([sys.executable, "-c", program, "bench", str(grid), *where, *data, *words])


def steps_of(run: Path) -> int:
    """Steps that a run has written down."""
    file = run / "metrics.jsonl"
    lines = file.read_text().splitlines() if file.is_file() else []
    return json.loads(lines[-1])["env_steps"] if lines else 0


def parent(process: int) -> int:
    """Who started a process: of a training that is the worker."""
    said = subprocess.run(
        ["ps", "-o", "ppid=", "-p", str(process)], capture_output=True, text=True, check=True
    )
    return int(said.stdout)


def kill_half_way(running: subprocess.Popen[bytes], run: Path, settings: Settings) -> int:
    """Kill the worker that plays a run once half of it is done; its steps then."""
    end = time.monotonic() + settings.wait_s
    while (steps := steps_of(run)) < settings.steps // 2:
        if running.poll() is not None or time.monotonic() > end:
            raise SystemExit(f"{run.name} was not half-way when it ended, or after {settings.wait_s:.0f} s")
        time.sleep(0.05)
    training = int((run / ".lock").read_text())
    worker = parent(training)
    os.kill(worker, signal.SIGKILL)
    time.sleep(2)
    said = subprocess.run(["ps", "-o", "stat=", "-p", str(training)], capture_output=True, text=True).stdout
    gone = not said.strip() or said.startswith("Z")
    print(f"killed worker {worker} at step {steps:,}; its training is {'gone' if gone else 'still there'}")
    return steps


def results(folder: Path) -> dict[str, dict[str, Any]]:
    """Every result by its name, but for the clock."""
    found = {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob("*/*.json"))}
    return {name: {k: v for k, v in one.items() if k not in CLOCK} for name, one in found.items()}


def main(settings: Settings) -> None:
    """Run both and compare; exit status 1 where they are not the same."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        grid = folder / "small.toml"
        grid.write_text(GRID.format(steps=settings.steps))
        cells = expand(read_grid(grid))
        began = time.monotonic()
        if bench(grid, folder, "pool").wait():
            raise SystemExit("the grid failed by processes here")
        pool_s, began = time.monotonic() - began, time.monotonic()
        running = bench(grid, folder, "ray", "--ray", "local")
        kill_half_way(running, folder / "ray" / "runs" / "small" / cells[0].name, settings)
        if running.wait():
            raise SystemExit("the grid failed on Ray")
        ray_s = time.monotonic() - began
        ours, theirs = results(folder / "pool" / "results"), results(folder / "ray" / "results")
    same = [cell.name for cell in cells if ours[cell.name] == theirs[cell.name]]
    for name, one in theirs.items():
        print(
            f"{name}: return {one['return_mean']!r}, score {one['score']!r}, {len(one['curve'])} evaluations"
        )
    print(f"{len(same)} of {len(cells)} cells the same; {pool_s:.0f} s by processes, {ray_s:.0f} s on Ray")
    raise SystemExit(0 if len(same) == len(cells) else 1)


if __name__ == "__main__":
    main(tyro.cli(Settings))
