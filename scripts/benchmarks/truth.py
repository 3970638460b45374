"""Every judged reward in one table: its policy, its terms, how it orders policies, and what it teaches.

    python scripts/benchmarks/truth.py [--only airl gail] [--tasks Hopper-v5]

Runs nothing: it joins what judged.py, retrained.py and transferred.py left in results. Of retrained policies
those count that learned from the reward at the end of its run, by the task's learner below. A reward that was
judged on another probe than the others of its task, or by another discount, has no numbers of that probe.
FINDINGS.md has the table, which a test makes again.
"""

import json
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

# beside this file
from judged import HAND_WRITTEN, alone, reward_name, usual
from judged import RESULTS as REWARDS

from irl.envs.tasks import task_name

BONUS = "--ppo.ent-coef 0.01 --ppo.ent-schedule linear"
"""PPO whose bonus on its entropy falls to 0: the words of `irl retrain` that a row must have been made by."""
SHORT = (
    "--ppo.gamma 0.98 --ppo.gae-lambda 0.9 --ppo.lr 3e-4 --ppo.lr-schedule constant --ppo.n-epochs 10 "
    "--ppo.target-kl 0.03 --ppo.steps-per-round 4096 --ppo.hidden 128 128 --ppo.average 0.95"
)
"""Those of Ant-v5: PPO by the settings of `--preset gail-steady`."""
LEARNERS = {"ant": SHORT}
"""Where it is not PPO with that bonus."""
HEAD = (
    "reward",
    "task",
    "seed",
    "its policy",
    "VAL",
    "shares of forward, ctrl",
    "ctrl to forward",
    "bonus to forward",
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


def learner(row: dict[str, Any]) -> str:
    """The words by which a policy was retrained, without those that chose its reward."""
    words = iter(shlex.split(row["extra"]))
    kept: list[str] = []
    for word in words:
        if word == "--part":
            next(words)
        elif word not in ("--average", f"--{HAND_WRITTEN}"):
            kept.append(word)
    return " ".join(kept)


def circumstances(row: dict[str, Any]) -> tuple[Any, ...]:
    """All that a policy was retrained by but its reward.

    Whose run it was is none of it: on the hand-written reward PPO returned the same to the last digit beside
    DAC and beside AIRL, on Hopper and HalfCheetah. Nor is the normaliser, which runs of a task share here.
    """
    task = row["run"].rpartition("-s")[0].rpartition("-")[2]
    seeds = tuple(row.get("seeds") or (row["seed"],))
    return task, row.get("dynamics"), row["env_steps"], seeds, learner(row)


def same(row: dict[str, Any], found: dict[str, Any]) -> bool:
    """Whether a policy was retrained by the task's learner, on this reward as it was at the end."""
    task = task_name(found["task"])
    by = learner(row) == LEARNERS.get(task, BONUS) and row["snapshot"] == found["env_steps"]
    run = f"{found['method']}-{task}-s{found['seed']}"
    return by and row["run"] == run and reward_of(row) == found["reward"]


def line(
    found: dict[str, Any],
    fresh: list[dict[str, Any]],
    controls: dict[tuple[Any, ...], Any],
    why_not: str | None = None,
) -> str:
    """A row; a dash is what is unknown, or may not be believed; `why_not` (judged.alone) is said instead."""
    here = [row for row in fresh if "dynamics" not in row]
    control = [controls[key]["score"] for key in map(circumstances, here) if key in controls]
    taught = [f"{row['score']:.3f} ({row['score'] / row['score_of_the_run']:.2f})" for row in here]
    there = [elsewhere(row, controls.get(circumstances(row))) for row in fresh if "dynamics" in row]
    cells = (
        found["reward"],
        found["task"].removesuffix("-v5"),
        str(found["seed"]),
        f"{found['score']:.3f}",
        *(judged_by_probe(found) if why_not is None else "––––––"),
        "; ".join(taught) or "–",
        "; ".join(f"{score:.3f}" for score in control) or "–",
        "; ".join(there) or "–",
        why_not or ", ".join(name for name, fired in found["verdicts"].items() if fired) or "none",
    )
    return f"| {' | '.join(cells)} |"


def judged_by_probe(found: dict[str, Any]) -> tuple[str, ...]:
    """VAL, shares, what control and not ending weigh to forward, what is explained, Kendall."""
    terms, weights = found["terms"], found["terms"].get("weights") or {}
    forward, ctrl = weights.get("forward", {}), weights.get("ctrl", {})
    # to forward, so a forward that may weigh nothing is the unit of neither
    unit = abs(forward["weight"]) if forward.get("why_not") is None and _sided(forward) else None
    control = ctrl.get("weight") if ctrl.get("why_not") is None else None
    return (
        _two(found["distances"]["headline"]["value"]),
        f"{_share(forward)}, {_share(ctrl)}",
        _two(_over(control, unit)),
        _two(_over(terms.get("survival_bonus"), unit)),
        _two(terms.get("explained")),
        _two(found["cross_play"]["kendall"]["value"]),
    )


def _sided(weight: dict[str, Any]) -> bool:
    """Whether its interval lies on one side of 0."""
    low, high = weight.get("low"), weight.get("high")
    return low is not None and high is not None and (low > 0 or high < 0)


def _share(weight: dict[str, Any]) -> str:
    """A share and the sign of its weight, which it does not have: (-) below 0, (?) on both sides of it."""
    sign = ""
    if weight.get("low") is not None:
        sign = " (?)" if not _sided(weight) else " (-)" if weight["high"] < 0 else ""
    return _two(weight.get("share")) + sign


def _over(value: float | None, unit: float | None) -> float | None:
    return None if value is None or unit is None else value / unit


def elsewhere(row: dict[str, Any], control: dict[str, Any] | None) -> str:
    """Returns under other dynamics: of the run's own policy, of fresh ones, and of the control's."""
    true = returns(control["returns"]) if control else "–"
    return f"{row['dynamics']}: {row['beside']:.0f}, {returns(row['returns'])}, {true}"


def returns(values: list[float]) -> str:
    """One a fresh seed."""
    return " ".join(f"{value:.0f}" for value in values)


def _two(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def table(settings: Settings) -> str:
    """A line a reward and seed that judged.py has."""
    results = settings.results
    rows = [*read(results / "fresh"), *read(results / "transfer")]
    fresh = [row for row in rows if "snapshot" in row]
    controls = {circumstances(row): row for row in fresh if reward_of(row) == HAND_WRITTEN}
    judged = [found for found in read(results / "rewards") if "verdicts" in found]
    usually = usual(judged)
    lines = [f"| {' | '.join(HEAD)} |", "|---" * len(HEAD) + "|"]
    for found in sorted(judged, key=lambda of: (of["task"], of["method"], of["reward"], of["seed"])):
        if settings.only and found["method"] not in settings.only:
            continue
        if settings.tasks and found["task"] not in settings.tasks:
            continue
        of_it = [row for row in fresh if same(row, found)]
        lines.append(line(found, of_it, controls, alone(found, usually)))
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(tyro.cli(Settings)))
