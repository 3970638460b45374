"""What `make quickstart` reaches: score and seconds of several seeds, one after the other.

    python scripts/benchmarks/quickstart.py --seeds 1 2 3

Each seed runs the three commands of `make quickstart` in processes of their own and is judged by the
policy at the last step, in 20 episodes of seeds that training never saw. Writes results/quickstart.json.
"""

import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from irl.core.provenance import command_line, environment

ENV_ID = "Hopper-v5"
RESULTS = Path(__file__).parent / "results" / "quickstart.json"


@dataclass(frozen=True)
class Settings:
    """Which seeds to run, and where the results go."""

    seeds: tuple[int, ...] = (1, 2, 3)
    """Seeds of training; none of them was used to choose a setting."""
    out: Path = RESULTS
    """The JSON to write."""


def irl(*words: str) -> float:
    """Run one command; its wall-clock seconds, start-up included."""
    began = time.monotonic()
    program = "from irl.experiment.cli import main; main()"
    subprocess.run([sys.executable, "-c", program, *words], check=True, stdout=subprocess.DEVNULL)
    return time.monotonic() - began


def one(seed: int, folder: Path) -> dict[str, Any]:
    """Demonstrations, training and evaluation of one seed."""
    root, run = folder / "datasets", folder / "run"
    where = ("--datasets-root", str(root))
    demos_s = irl("demos", "generate", "--env-id", ENV_ID, "--episodes", "25", "--seed", "0", *where)
    words = ("train", "gail", "--env-id", ENV_ID, "--demos", "irl/hopper/expert-v0", "--demo-episodes", "4")
    train_s = irl(*words, "--seed", str(seed), "--out", str(run), *where)
    evaluate_s = irl("evaluate", str(run))
    found = json.loads((run / "evaluation.json").read_text())
    lines = (run / "metrics.jsonl").read_text().splitlines()
    rows = [json.loads(line) for line in lines]
    return {
        "seed": seed,
        "env_steps": found["env_steps"],
        "return_mean": found["policy"]["return_mean"],
        "return_std": found["policy"]["return_std"],
        "normalised_score": found["policy"]["normalised_score"],
        "pearson": found["reward"]["pearson"],
        "spearman": found["reward"]["spearman"],
        "auroc": found["reward"]["auroc"],
        "demos_s": round(demos_s, 1),
        "train_s": round(train_s, 1),
        "evaluate_s": round(evaluate_s, 1),
        "total_s": round(demos_s + train_s + evaluate_s, 1),
        "curve": [[r["env_steps"], r["eval_return_mean"]] for r in rows if "eval_return_mean" in r],
    }


def main(settings: Settings) -> None:
    """Run every seed, print and write the results."""
    rows = []
    # before the first result is written: the tree is not clean after it
    facts = environment(f"python scripts/benchmarks/{command_line()}")
    for seed in settings.seeds:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(one(seed, Path(folder)))
        shown = {name: value for name, value in rows[-1].items() if name != "curve"}
        print(json.dumps(shown), flush=True)
        settings.out.parent.mkdir(exist_ok=True)
        settings.out.write_text(json.dumps({"task": ENV_ID, **facts, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main(tyro.cli(Settings))
