"""Seconds of training until GAIL is .9 of the expert: irl at its defaults, the peer at its tuned settings.

    python scripts/benchmarks/wallclock.py --peer-python peer/bin/python --seeds 1 2 3

Both learn from the same demonstrations, one thread each, one after the other. Every `every` steps the clock
stops and the deterministic policy plays `episodes` episodes whose seeds training never saw; the time of a
run is that of the first such evaluation at or above `share` of the way from random actions to the expert. A
run that does not get there within its steps is reported with the best that it reached. Starting up is not
counted. The peer plays Hopper-v4, whose dynamics are those of v5.

Goes on where it was stopped: a run that is in the results is not done again. Writes results/wallclock.json,
whose rows say by what settings, and where, each was made; rows of other settings are not added to.
"""

import json
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro
from contender import HERE, Contender, demonstrations, irl_words, peer_words

from irl.core.provenance import command_line, environment
from irl.policies.card import normalised_score
from irl.policies.shelf import expert_card

RESULTS = HERE / "results" / "wallclock.json"
EPISODES = 4
"""Demonstrations of both."""
KEPT = ("share", "every", "episodes", "peer_steps")
"""Settings that a row is made by, beside its task and seed."""


@dataclass(frozen=True)
class Settings:
    """What is run, and when it is there."""

    peer_python: Path | None = None
    """Python of the peer's own environment (see throughput_peer.py); without it the peer is left out."""
    task: str = "Hopper-v5"
    """Gymnasium id; the shelf must have an expert of it."""
    seeds: tuple[int, ...] = (1,)
    """Seeds of training."""
    share: float = 0.9
    """How far from random actions to the expert a policy must be."""
    every: int = 8192
    """Least environment steps between two evaluations."""
    episodes: int = 5
    """Episodes of an evaluation."""
    peer_steps: int = 2_000_000
    """Steps after which the peer is given up; irl's defaults end by themselves."""
    out: Path = RESULTS
    """The JSON to write, and to go on with."""


def run(name: str, seed: int, settings: Settings, root: Path) -> dict[str, Any]:
    """One run until it is there, or over."""
    demos = demonstrations(settings.task, root, EPISODES)
    more = [str(seed), str(settings.episodes)]
    if name == "irl":
        words = irl_words("wallclock_ours.py", settings.task, str(root), *more)
    else:
        assert settings.peer_python is not None
        words = peer_words(settings.peer_python, "wallclock_peer.py", settings.task, demos, *more)
    card = expert_card(settings.task)
    assert card is not None
    contender = Contender(f"{name} {seed}", words)
    curve: list[list[float]] = []
    steps, seconds, score = 0, 0.0, 0.0
    try:
        while score < settings.share and steps < settings.peer_steps:
            done = contender.turn(settings.every)
            if not done["steps"]:
                break
            steps, seconds = steps + done["steps"], seconds + done["seconds"]
            score = normalised_score(done["return_mean"], card.random_return_mean, card.measured.return_mean)
            curve.append([steps, round(seconds, 1), round(score, 4)])
            print(f"{name} seed {seed}: {steps:>8} steps {seconds:7.1f} s  score {score:.3f}", flush=True)
    finally:
        contender.close()
    there = score >= settings.share
    return {
        "name": name,
        "task": settings.task,
        "seed": seed,
        "seconds": curve[-1][1] if there else None,
        "steps": steps if there else None,
        "best": max(row[2] for row in curve),
        "curve": curve,
    }


def read_rows(settings: Settings) -> list[dict[str, Any]]:
    """The rows of a file to go on with; none where there is none.

    Raises:
        SystemExit: one was made by other settings.
    """
    if not settings.out.exists():
        return []
    found = json.loads(settings.out.read_text())
    # rows said nothing of themselves once: what the file said was of them all
    whole = {name: value for name, value in found.items() if name not in ("rows", "times_shorter", "commit")}
    rows = [{**row, **{k: v for k, v in whole.items() if k not in row}} for row in found["rows"]]
    for row in rows:
        asked = {name: getattr(settings, name) for name in KEPT if name in row}
        if other := [f"--{k.replace('_', '-')} {row[k]}, not {v}" for k, v in asked.items() if row[k] != v]:
            made = f"{row['name']} seed {row['seed']} in {settings.out} was made with"
            raise SystemExit(f"{made} {'; '.join(other)}; choose another --out")
    return rows


def result(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Everything that is written: with the peer's median over ours where every run got there."""
    seconds = {name: [row["seconds"] for row in rows if row["name"] == name] for name in ("irl", "imitation")}
    both = all(times and None not in times for times in seconds.values())
    ratio = statistics.median(seconds["imitation"]) / statistics.median(seconds["irl"]) if both else None
    return {"rows": rows, "times_shorter": ratio}


def main(settings: Settings) -> None:
    """Do the runs that are not in the results yet, and write after each."""
    facts = environment(f"python scripts/benchmarks/{command_line()}")
    made_by = {**{name: getattr(settings, name) for name in KEPT}, **facts, "threads": 1}
    rows = read_rows(settings)
    done = {(row["name"], row["task"], row["seed"]) for row in rows}
    names = ("irl", "imitation") if settings.peer_python else ("irl",)
    for seed in settings.seeds:
        for name in names:
            if (name, settings.task, seed) in done:
                continue
            with tempfile.TemporaryDirectory() as folder:
                rows.append({**run(name, seed, settings, Path(folder)), **made_by})
            settings.out.parent.mkdir(exist_ok=True)
            settings.out.write_text(json.dumps(result(rows), indent=1) + "\n")
    print(json.dumps({"times_shorter": result(rows)["times_shorter"]}))


if __name__ == "__main__":
    main(tyro.cli(Settings))
