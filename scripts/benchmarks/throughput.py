"""Environment steps a second, side by side: irl's methods, SB3 alone, the main peer.

    python scripts/benchmarks/throughput.py --peer-python peer/bin/python

Every contender is a process of its own with one thread, started and warmed up before anything is timed.
Then they take turns, A B C A B C, so that whatever else the machine does hits all of them alike; while one
runs the others wait. A contender's figure is the median of its turns. Where the time goes is taken in
a further turn, under the same conditions, by a process that watches its own parts.

Writes results/throughput.json.
"""

import contextlib
import json
import statistics
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro
from contender import Contender, demonstrations, irl_words, peer_words

from irl.core import products
from irl.core.provenance import command_line, environment

RESULTS = Path(__file__).parent / "results" / "throughput.json"
OURS = ("gail", "airl", "sb3-ppo", "dac", "dac-defaults", "dac-float32", "sb3-sac")
PEERS = ("gail", "airl")
EPISODES = 10
"""Demonstrations: the peer's tuned GAIL draws 8192 steps at once and starts with no fewer."""
RATIOS = {
    "gail_vs_imitation": ("gail", "imitation-gail"),
    "airl_vs_imitation": ("airl", "imitation-airl"),
    "gail_vs_sb3_ppo": ("gail", "sb3-ppo"),
    "dac_vs_sb3_sac": ("dac", "sb3-sac"),
    "dac_defaults_vs_sb3_sac": ("dac-defaults", "sb3-sac"),
    "dac_vs_sb3_sac_float32": ("dac-float32", "sb3-sac"),
}


@dataclass(frozen=True)
class Settings:
    """What is timed, and for how long."""

    peer_python: Path | None = None
    """Python of the peer's own environment (see throughput_peer.py); without it the peer is left out."""
    tasks: tuple[str, ...] = ("Hopper-v5", "HalfCheetah-v5")
    """Gymnasium ids; the shelf must have an expert of each."""
    turns: int = 4
    """Turns of each contender."""
    seconds: float = 4.0
    """Least seconds of a turn; it ends with the round under way."""
    out: Path = RESULTS
    """The JSON to write."""


def ours() -> tuple[tuple[str, ...], dict[str, str]]:
    """Those of ours that this processor is fit for, and why each of the others is left out."""
    if products.fastest() == "bfloat16":
        return OURS, {}
    why = "this processor has no bfloat16 instructions and emulates each product"
    return tuple(name for name in OURS if name != "dac"), {"dac": why}


@contextlib.contextmanager
def contenders(settings: Settings, task: str, root: Path) -> Iterator[list[Contender]]:
    """Everybody, warmed up."""
    made = []
    try:
        for name in ours()[0]:
            made.append(Contender(name, irl_words("throughput_ours.py", name, task, str(root))))
        for name in PEERS if settings.peer_python else ():
            assert settings.peer_python is not None
            script, demos = "throughput_peer.py", root / f"{task}.npz"
            words = peer_words(settings.peer_python, script, task, demos, before=(name,))
            made.append(Contender(f"imitation-{name}", words))
        yield made
    finally:
        for contender in made:
            contender.close()


def timed(settings: Settings, task: str, root: Path) -> list[dict[str, Any]]:
    """A row for each contender."""
    speeds: dict[str, list[float]] = {}
    with contenders(settings, task, root) as everybody:
        for turn in range(settings.turns):
            for contender in everybody:
                done = contender.turn(settings.seconds)
                speeds.setdefault(contender.name, []).append(done["steps"] / done["seconds"])
                print(
                    f"{task} turn {turn + 1} {contender.name:<15} {speeds[contender.name][-1]:8.1f} steps/s"
                )
    rows = []
    for name, found in speeds.items():
        row = {"name": name, "task": task, "steps_per_s": statistics.median(found), "turns": found}
        rows.append(row | {"shares": shares(settings, name, task, root)})
    return rows


def shares(settings: Settings, name: str, task: str, root: Path) -> dict[str, float]:
    """Which share of its time each part of one of ours takes."""
    if name.startswith(("sb3", "imitation")):
        return {}
    contender = Contender(name, irl_words("throughput_ours.py", name, task, str(root), "--shares"))
    try:
        done = contender.turn(2 * settings.seconds)
    finally:
        contender.close()
    of = {part: seconds / done["seconds"] for part, seconds in done["shares"].items()}
    return of | {"rest": 1.0 - sum(of.values())}


def ratios(rows: list[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """The claims: one contender's speed over another's, by task."""
    speed = {(row["name"], row["task"]): row["steps_per_s"] for row in rows}
    tasks = sorted({row["task"] for row in rows}, reverse=True)
    return {
        claim: {
            task: speed[a, task] / speed[b, task] for task in tasks if {(a, task), (b, task)} <= set(speed)
        }
        for claim, (a, b) in RATIOS.items()
    }


def main(settings: Settings) -> None:
    """Time every task, print and write the results."""
    rows: list[dict[str, Any]] = []
    # before the results are written: the tree is not clean after it
    facts, left_out = environment(f"python scripts/benchmarks/{command_line()}"), ours()[1]
    for name, why in left_out.items():
        print(f"without {name}: {why}")
    for task in settings.tasks:
        with tempfile.TemporaryDirectory() as folder:
            demonstrations(task, Path(folder), EPISODES)
            rows += timed(settings, task, Path(folder))
        # after each task: what follows may fail, and a quiet machine is dear
        result = {"rows": rows, "ratios": ratios(rows), "commit": facts["git_commit"], **facts}
        result |= {"threads": 1, "skipped": left_out}
        settings.out.parent.mkdir(exist_ok=True)
        settings.out.write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps(ratios(rows), indent=1))


if __name__ == "__main__":
    main(tyro.cli(Settings))
