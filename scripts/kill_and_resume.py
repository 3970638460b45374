"""Kill runs with SIGKILL at random moments, resume them, and compare with a run that nobody killed.

    python scripts/kill_and_resume.py --kills 20

Three runs on Hopper-v5: GAIL with PPO, DAC, and a SAC expert. Each is killed at `kills` moments drawn
over its length, resumed after each, and must end with the same weights and metrics, but for the clock's.
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
from typing import Literal

import tyro

from irl.core.rng import stream

PROGRAM = (sys.executable, "-c", "from irl.experiment.cli import main; main()")
WATCH = (
    "--watch.no-progress",
    "--watch.no-tensorboard",
    "--watch.checkpoint-every-s=0",
    "--watch.eval-every=3",
)
GAIL = (
    "train",
    "gail",
    "--env-id",
    "Hopper-v5",
    "--steps",
    "20480",
    "--learner.steps-per-round",
    "512",
    *WATCH,
)
DAC = ("train", "dac", "--env-id", "Hopper-v5", "--demo-episodes", "4", "--steps", "3000", *WATCH)
SAC = ("experts", "train", "--env-id", "Hopper-v5", "--algo", "sac", "--steps", "7000", *WATCH)


@dataclass(frozen=True)
class Settings:
    """How often to kill."""

    kills: int = 20
    """Kills of each run."""
    runs: tuple[Literal["gail", "dac", "sac"], ...] = ("gail", "dac", "sac")
    """Which of them."""
    seed: int = 0
    """Draws the moments."""


def run(words: tuple[str, ...], folder: Path, kill_after_s: float | None = None) -> bool:
    """Run one command to its end, or kill it; whether it came to its end."""
    env = os.environ | {"MINARI_DATASETS_PATH": str(folder / "datasets"), "OMP_NUM_THREADS": "1"}
    log = (folder / "log.txt").open("a")
    process = subprocess.Popen([*PROGRAM, *words], cwd=folder, env=env, stdout=log, stderr=log)
    try:
        if process.wait(timeout=kill_after_s) != 0:
            raise RuntimeError(f"{' '.join(words)} failed:\n{(folder / 'log.txt').read_text()[-2000:]}")
        return True
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.wait()
        return False


def ends(run_folder: Path) -> tuple[dict[str, bytes], list[dict]]:
    """Every file of the last snapshot, and the metrics without wall clock."""
    last = sorted((run_folder / "snapshots").iterdir())[-1]
    weights = {p.relative_to(last).as_posix(): p.read_bytes() for p in sorted(last.rglob("*.safetensors"))}
    rows = [json.loads(line) for line in (run_folder / "metrics.jsonl").read_text().splitlines()]
    return weights, [{k: v for k, v in row.items() if k not in ("wall_s", "checkpoint_s")} for row in rows]


def compare(name: str, start: tuple[str, ...], resume: tuple[str, ...], folder: Path, s: Settings) -> bool:
    """One run straight through, and runs killed again and again; whether all end the same."""
    began = time.monotonic()
    run((*start, "--out", "straight"), folder)
    whole_s = time.monotonic() - began
    rng = stream(s.seed, f"kills of {name}")
    expected, kills, runs, same = ends(folder / "straight"), 0, 0, 0
    while kills < s.kills:
        killed, begun, ended = f"killed{runs}", False, False
        while not ended:
            words = (*resume, killed) if begun else (*start, "--out", killed)
            # anywhere, the start-up and the first writes too; what is resumed often ends before its moment
            moment = float(rng.uniform(0.0, 0.9 * whole_s)) if kills < s.kills else None
            began = time.monotonic()
            ended = run(words, folder, moment)
            if ended and not begun:
                whole_s = min(whole_s, time.monotonic() - began)  # the machine was busier before
            kills += not ended
            begun = (folder / killed / "config.json").is_file()
        runs += 1
        same += ends(folder / killed) == expected
    print(f"{name}: {kills} kills in {runs} runs, {same} of {runs} end as the one not killed", flush=True)
    return same == runs


def main(settings: Settings) -> None:
    """The runs that were asked for; exit status 1 when one ends differently."""
    train, expert = ("train", "--resume"), ("experts", "train", "--policies-root", "shelf", "--resume")
    runs: dict[str, tuple[tuple[str, ...], tuple[str, ...]]]
    runs = {"gail": (GAIL, train), "dac": (DAC, train), "sac": ((*SAC, "--policies-root", "shelf"), expert)}
    same = []
    for name in settings.runs:
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            run(("demos", "generate", "--env-id", "Hopper-v5", "--episodes", "5"), folder)
            start, resume = runs[name]
            same.append(compare(name, start, resume, folder, settings))
    raise SystemExit(0 if all(same) else 1)


if __name__ == "__main__":
    main(tyro.cli(Settings))
