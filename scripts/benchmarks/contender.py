"""What throughput.py and wallclock.py share: processes that train when told to, and what they learn from."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from irl.demos.load import load_demos
from irl.envs.tasks import task_name

HERE = Path(__file__).parent


class Contender:
    """A process that trains when it is told to."""

    def __init__(self, name: str, words: list[str]) -> None:
        self.name = name
        self._process = subprocess.Popen(
            words,
            text=True,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        if self._line() != "ready":
            raise SystemExit(f"{name} did not start; try it by hand: {' '.join(words)}")

    def turn(self, least: float) -> dict[str, Any]:
        """Train for at least so many seconds (wallclock.py: steps); what the process says of it."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{least}\n")
        self._process.stdin.flush()
        return json.loads(self._line())

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()


def demonstrations(task: str, root: Path, episodes: int) -> Path:
    """So many episodes of the expert's as a dataset in `root`, and as the arrays that the peer is given."""
    program = "from irl.experiment.cli import main; main()"
    words = ["demos", "generate", "--env-id", task, "--episodes", str(episodes), "--datasets-root", str(root)]
    subprocess.run([sys.executable, "-c", program, *words], check=True, stdout=subprocess.DEVNULL)
    shown = list(load_demos(f"irl/{task_name(task)}/expert-v0", root=root))
    arrays: dict[str, Any] = {"episodes": len(shown)}
    for i, e in enumerate(shown):
        arrays |= {f"obs{i}": e.obs, f"action{i}": e.action, f"reward{i}": e.reward}
        arrays[f"terminal{i}"] = e.terminated
    np.savez(path := root / f"{task}.npz", **arrays)
    return path


def irl_words(script: str, *words: str) -> list[str]:
    """What starts one of ours."""
    return [sys.executable, str(HERE / script), *words]


def peer_words(
    python: Path, script: str, task: str, demos: Path, *after: str, before: tuple[str, ...] = ()
) -> list[str]:
    """What starts the peer, which knows the version of the task before v5."""
    old = task.replace("-v5", "-v4")
    return [str(python), "-W", "ignore", str(HERE / script), *before, old, str(demos), *after]
