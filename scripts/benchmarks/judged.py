"""What `irl evaluate` found of some runs' rewards, as one short JSON a run.

    irl train gail --env-id Hopper-v5 --steps 245760 --seed 1 --demo-episodes 5 --out runs/gail-hopper
    irl evaluate runs/gail-hopper
    python scripts/benchmarks/judged.py runs/gail-hopper
    python scripts/benchmarks/judged.py --table

Distances to the hand-written reward, weights of its terms, cross-play, drift over the snapshots, the
discriminator's health, verdicts; numbers to four digits. Writes results/rewards/<reward>-<task>-s<seed>.json,
where a reward is a method, `airl-f` (of `irl evaluate --part f`), `airl-states` (g of states alone), or one
of these with `-average` (of `irl evaluate --average`). Files without a seed are older, and have fewer of
these. The table has no number of a reward that was judged on another probe, or by another discount, than the
others of its task.
"""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from irl.envs.tasks import task_name

RESULTS = Path(__file__).parent / "results" / "rewards"
HAND_WRITTEN = "hand-written"
"""The reward of a control: the same learner, and the task's own reward."""
AGREEMENT = ("spearman", "kendall", "regret")
DRIFT = ("snapshots", "n", "cycling", "speed", "to_final", "sign_flips", "outside")


@dataclass(frozen=True)
class Settings:
    """Whose rewards."""

    runs: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Run folders that `irl evaluate` has judged."""
    out: Path = RESULTS
    """Where the JSON goes."""
    table: bool = False
    """Print what is there: a line a reward at its end, and a line a reward over its snapshots."""


def short(content: Any) -> Any:
    """The same with numbers of four digits."""
    if isinstance(content, float):
        return round(content, 4)
    if isinstance(content, dict):
        return {name: short(value) for name, value in content.items()}
    return [short(value) for value in content] if isinstance(content, list) else content


def reward_name(config: dict[str, Any], found: dict[str, Any]) -> str:
    """The method, with the part or the inputs that are not its default."""
    states = config["discriminator"].get("inputs") == "obs"
    part = found.get("part")
    words = ("states" if states else None, None if part == "g" else part)
    average = "average" if found.get("average") else None
    return "-".join(filter(None, (found["method"], *words, average)))


def judged(run: Path, file: Path) -> dict[str, Any]:
    """What is published of one evaluation of a run."""
    found = json.loads(file.read_text())
    config = json.loads((run / "config.json").read_text())
    environment = json.loads((run / "environment.json").read_text())
    drift, agrees = found["drift"], found["cross_play"]["agreement"]
    healths = [of["held_out"] or of["train"] for of in drift["health"]]
    moved = {name: drift[name] for name in DRIFT if name in drift}
    return {
        "method": found["method"],
        "reward": reward_name(config, found),
        "seed": config["seed"],
        "task": found["env_id"],
        "env_steps": found["env_steps"],
        "return_mean": found["policy"]["return_mean"],
        "score": found["policy"]["normalised_score"],
        "distances": found["distances"],
        "terms": found["terms"],
        "residual": {name: found["residual"].get(name) for name in ("r2", "share")},
        "cross_play": {name: agrees[-1][name] for name in AGREEMENT},
        "kendall": [of["kendall"]["value"] for of in agrees],
        "policies": len(found["cross_play"]["policies"]),
        # an episode's return by the last reward, of each
        "paid": dict(zip(_names(found["cross_play"]), found["cross_play"]["learned"][-1], strict=True)),
        "chosen": found["chosen"].get("compared"),
        "verdicts": {of["name"]: of["fired"] for of in found["verdicts"]},
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


def _names(cross_play: dict[str, Any]) -> list[str]:
    return [policy["name"] for policy in cross_play["policies"]]


def probe_of(found: dict[str, Any]) -> tuple[str, str, float]:
    """What two rewards have to share for their numbers to be compared: task, probe and discount."""
    return found["task"], found["distances"]["probe_sha256"], found["distances"]["gamma"]


def usual(rows: Sequence[dict[str, Any]]) -> set[tuple[str, str, float]]:
    """By which most rewards of each task were judged; of two as frequent, by the larger probe."""
    often = Counter(map(probe_of, rows))
    steps = {probe_of(found): found["distances"]["steps"] for found in rows}
    return set({of[0]: of for of in sorted(often, key=lambda of: (often[of], steps[of]))}.values())


def alone(found: dict[str, Any], usually: set[tuple[str, str, float]]) -> str | None:
    """Why a reward's numbers cannot stand beside those of its task; None where they can."""
    if probe_of(found) in usually:
        return None
    _, digest, gamma = probe_of(found)
    return f"on another probe: {digest[:8]}, {found['distances']['steps']:,} steps, gamma {gamma:g}"


def row(found: dict[str, Any], why_not: str | None = None) -> str:
    """One line of the table; `why_not` where its numbers are no others' to be compared with."""
    score = f"{found['score']:.3f}"
    if why_not:
        return f"| {' | '.join((*_whose(found), score, *'–––––––', why_not))} |"
    terms, distance, agrees = found["terms"], found["distances"]["headline"], found["cross_play"]
    forward = (terms.get("weights") or {}).get("forward")
    said = f"{forward['weight']:.2f} ({forward['low']:.2f} to {forward['high']:.2f})" if forward else "–"
    between = [_two(agrees[name]["value"]) for name in AGREEMENT]
    fired = ", ".join(name for name, is_so in found["verdicts"].items() if is_so) or "none"
    cells = (
        *_whose(found),
        score,
        f"{distance['value']:.2f}",
        said,
        _two(terms.get("survival_bonus")),
        _two(terms.get("explained")),
        *between,
        fired,
    )
    return f"| {' | '.join(cells)} |"


def _two(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _whose(found: dict[str, Any]) -> tuple[str, str, str]:
    return found["reward"], found["task"].removesuffix("-v5"), str(found["seed"])


def over_run(found: dict[str, Any]) -> str:
    """One line a number that the reward has at each snapshot after the first, at shares of the run."""
    drift = found["drift"]
    shares = [f"{100 * steps / drift['snapshots'][-1]:.3g} %" for steps in drift["snapshots"][1:]]
    rows = {"at": shares, "VAL": map(_two, drift["to_truth"][1:]), "Kendall": map(_two, found["kendall"][1:])}
    return "\n".join(f"| {' | '.join((*_whose(found), name, *values))} |" for name, values in rows.items())


def tables(out: Path) -> str:
    """Of all files that have the verdicts too."""
    known = ("reward", "task", "seed", "score", "VAL", "forward (95 %)", "bonus", "explained")
    head = (*known, "Spearman", "Kendall", "regret", "verdicts")
    files = [json.loads(file.read_text()) for file in sorted(out.glob("*.json"))]
    full = [found for found in files if "verdicts" in found]
    usually = usual(full)
    ends = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    ends += [row(found, alone(found, usually)) for found in full]
    return "\n".join([*ends, "", *(over_run(found) for found in full if not alone(found, usually))])


def main(settings: Settings) -> None:
    """Read and write each."""
    settings.out.mkdir(parents=True, exist_ok=True)
    for run in settings.runs:
        for file in sorted(run.glob("evaluation*.json")):
            found = judged(run, file)
            name = f"{found['reward']}-{task_name(found['task'])}-s{found['seed']}"
            target = settings.out / f"{name}.json"
            target.write_text(json.dumps(short(found), indent=1) + "\n")
            print(f"{target.name}: {found['return_mean']:.0f}")
    if settings.table:
        print(tables(settings.out))


if __name__ == "__main__":
    main(tyro.cli(Settings))
