"""Every judged reward in one table: its policy, its terms, how it orders policies, and what it teaches.

    python scripts/benchmarks/truth.py [--only airl gail] [--tasks Hopper-v5]

Runs nothing: it joins what judged.py, retrained.py and transferred.py left in results. Of retrained policies
those count that learned from the reward at the end of its run, by the one learner below. FINDINGS.md has the
table, which a test makes again.
"""

import json
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

# beside this file
from judged import RESULTS as REWARDS
from judged import reward_name

LEARNER = "--ppo.ent-coef 0.01 --ppo.ent-schedule linear"
"""PPO whose bonus on its entropy falls to 0: the words of `irl retrain` that a row must have been made by."""
HAND_WRITTEN = "hand-written"
"""The reward of a control: the same learner, and the task's own reward."""
HEAD = (
    "reward",
    "task",
    "seed",
    "its policy",
    "VAL",
    "shares of forward, ctrl",
    "ctrl to forward",
    "bonus",
    "explained",
    "Kendall",
    "a fresh policy",
    "of the hand-written",
    "elsewhere: its policy, a fresh one, of the hand-written",
    "verdicts",
)


@dataclass(frozen=True)
class Settings:
    """Which rows."""

    only: tuple[str, ...] = ()
    """Methods; all where none is given."""
    tasks: tuple[str, ...] = ()
    """Gymnasium ids; all where none is given."""
    results: Path = REWARDS.parent
    """The folder with rewards, fresh and transfer."""


def read(folder: Path) -> Iterator[dict[str, Any]]:
    """Every JSON below a folder."""
    for file in sorted(folder.rglob("*.json")):
        yield json.loads(file.read_text())


def reward_of(row: dict[str, Any]) -> str:
    """The name that judged.py gives the reward which a policy was retrained on."""
    if "reward" in row:
        return row["reward"]
    # older rows do not say it, and none of theirs is of states alone
    return reward_name({"discriminator": {}}, row | {"average": "--average" in shlex.split(row["extra"])})


def same(row: dict[str, Any], found: dict[str, Any]) -> bool:
    """Whether a policy was retrained by the learner, on this reward as it was at the end."""
    run = f"{found['method']}-{found['task'].removesuffix('-v5').lower()}-s{found['seed']}"
    by = LEARNER in row["extra"] and row["snapshot"] == found["env_steps"]
    return by and row["run"] == run and reward_of(row) in (found["reward"], HAND_WRITTEN)


def line(found: dict[str, Any], fresh: list[dict[str, Any]], elsewhere: list[dict[str, Any]]) -> str:
    """A row; a dash is what is unknown, or may not be believed."""
    control = [row for row in fresh if reward_of(row) == HAND_WRITTEN]
    fresh = [row for row in fresh if reward_of(row) != HAND_WRITTEN]
    terms, weights = found["terms"], found["terms"].get("weights") or {}
    forward, ctrl = weights.get("forward", {}), weights.get("ctrl", {})
    believed = ctrl.get("relative") if ctrl.get("why_not") is None else None
    taught = [f"{row['score']:.3f} ({row['score'] / row['score_of_the_run']:.2f})" for row in fresh]
    there = [
        f"{row['dynamics']}: {row['beside']:.0f}, {returns(row['returns'])}, {returns(row['truth'])}"
        for row in elsewhere
    ]
    cells = (
        found["reward"],
        found["task"].removesuffix("-v5"),
        str(found["seed"]),
        f"{found['score']:.3f}",
        _two(found["distances"]["headline"]["value"]),
        f"{_two(forward.get('share'))}, {_two(ctrl.get('share'))}",
        _two(believed),
        _two(terms.get("survival_bonus")),
        _two(terms.get("explained")),
        _two(found["cross_play"]["kendall"]["value"]),
        "; ".join(taught) or "–",
        "; ".join(f"{row['score']:.3f}" for row in control) or "–",
        "; ".join(there) or "–",
        ", ".join(name for name, fired in found["verdicts"].items() if fired) or "none",
    )
    return f"| {' | '.join(cells)} |"


def returns(values: list[float]) -> str:
    """One a fresh seed."""
    return " ".join(f"{value:.0f}" for value in values)


def _two(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def table(settings: Settings) -> str:
    """A line a reward and seed that judged.py has."""
    results = settings.results
    fresh, elsewhere = list(read(results / "fresh")), list(read(results / "transfer"))
    judged = [found for found in read(results / "rewards") if "verdicts" in found]
    lines = [f"| {' | '.join(HEAD)} |", "|---" * len(HEAD) + "|"]
    for found in sorted(judged, key=lambda of: (of["task"], of["method"], of["reward"], of["seed"])):
        if settings.only and found["method"] not in settings.only:
            continue
        if settings.tasks and found["task"] not in settings.tasks:
            continue
        here = [row for row in fresh if "snapshot" in row and same(row, found)]
        lines.append(line(found, here, [row for row in elsewhere if same(row, found)]))
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(tyro.cli(Settings)))
