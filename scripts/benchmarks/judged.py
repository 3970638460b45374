"""What `irl evaluate` found of some runs' rewards, as one short JSON a run.

    irl train gail --env-id Hopper-v5 --steps 245760 --seed 1 --demo-episodes 5 --out runs/gail-hopper
    irl evaluate runs/gail-hopper
    python scripts/benchmarks/judged.py runs/gail-hopper

Distances to the hand-written reward, weights of its terms, drift over the snapshots, the discriminator's
health; numbers to four digits. Writes results/rewards/<method>-<task>.json.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from irl.envs.tasks import task_name

RESULTS = Path(__file__).parent / "results" / "rewards"
DRIFT = ("snapshots", "n", "cycling", "speed", "to_final", "sign_flips", "outside")


@dataclass(frozen=True)
class Settings:
    """Whose rewards."""

    runs: tyro.conf.Positional[tuple[Path, ...]]
    """Run folders that `irl evaluate` has judged."""
    out: Path = RESULTS
    """Where the JSON goes."""


def short(content: Any) -> Any:
    """The same with numbers of four digits."""
    if isinstance(content, float):
        return round(content, 4)
    if isinstance(content, dict):
        return {name: short(value) for name, value in content.items()}
    return [short(value) for value in content] if isinstance(content, list) else content


def judged(run: Path) -> dict[str, Any]:
    """What is published of a run."""
    found = json.loads((run / "evaluation.json").read_text())
    environment = json.loads((run / "environment.json").read_text())
    drift = found["drift"]
    healths = [of["held_out"] or of["train"] for of in drift["health"]]
    moved = {name: drift[name] for name in DRIFT if name in drift}
    return {
        "method": found["method"],
        "task": found["env_id"],
        "env_steps": found["env_steps"],
        "return_mean": found["policy"]["return_mean"],
        "score": found["policy"]["normalised_score"],
        "distances": found["distances"],
        "terms": found["terms"],
        "drift": moved
        | {
            "to_truth": [distance["value"] for distance in drift["to_truth"]],
            "auroc": [of["auroc"] for of in healths],
            "ece": [of["ece"] for of in healths],
            "survival_bias": [of["survival_bias"] for of in drift["hygiene"]],
            "shares": [of["shares"] for of in drift["moves"]],
        },
        "trained_by": "irl " + environment["command"].removeprefix("irl ").removeprefix("-c "),
        **{name: environment[name] for name in ("git_commit", "machine", "threads")},
    }


def main(settings: Settings) -> None:
    """Read and write each."""
    settings.out.mkdir(parents=True, exist_ok=True)
    for run in settings.runs:
        row = judged(run)
        file = settings.out / f"{row['method']}-{task_name(row['task'])}.json"
        file.write_text(json.dumps(short(row), indent=1) + "\n")
        print(f"{file.name}: {row['return_mean']:.0f}")


if __name__ == "__main__":
    main(tyro.cli(Settings))
