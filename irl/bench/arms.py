"""Results grouped as tables compare them: by arm, then by task."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irl.bench.statistics import Estimate, averages, improvement, middle, steps_to
from irl.core.rng import stream
from irl.policies import shelf
from irl.policies.card import normalised_score

SHARES = (0.5, 0.9, 1.0)
"""Of the expert's score, by which speed is told."""
Result = Mapping[str, Any]


@dataclass(frozen=True)
class Arm:
    """One method with one setting and so many demonstrations."""

    method: str
    demos: str
    by_task: Mapping[str, Sequence[Result]]

    @property
    def runs(self) -> list[Result]:
        return [result for results in self.by_task.values() for result in results]

    def scores(self, tasks: Sequence[str]) -> list[np.ndarray]:
        """Of each of these tasks, the scores that are known."""
        return [
            np.array([r["score"] for r in self.by_task.get(task, ()) if r["score"] is not None])
            for task in tasks
        ]

    @property
    def scored_tasks(self) -> list[str]:
        return [
            task for task, found in zip(self.by_task, self.scores([*self.by_task]), strict=True) if len(found)
        ]


def arms_of(results: Sequence[Result]) -> list[Arm]:
    """In the order in which they first appear; seeds in theirs."""
    grouped: dict[tuple[str, str], dict[str, list[Result]]] = {}
    for result in sorted(results, key=lambda result: result["seed"]):
        thinned = f", 1 step in {result['demo_rate']}" if result["demo_rate"] > 1 else ""
        key = result["method"], f"{result['demos']}{thinned}"
        grouped.setdefault(key, {}).setdefault(result["task"], []).append(result)
    order = {(r["method"]): i for i, r in reversed([*enumerate(results)])}
    return [Arm(*key, grouped[key]) for key in sorted(grouped, key=lambda key: (order[key[0]], key[1]))]


def arm_averages(arm: Arm) -> tuple[Estimate, Estimate]:
    """Interquartile mean and mean of its scores, the same for the same results."""
    groups = arm.scores(arm.scored_tasks)
    return averages(groups, stream(0, f"bench averages {arm.method} {arm.demos}"))


def comparisons(arms: Sequence[Arm]) -> list[tuple[Arm, Arm, list[str], Estimate]]:
    """Of each pair that has a task in common, how probably a run of the first is above one of the second."""
    found = []
    for i, a in enumerate(arms):
        for b in arms[i + 1 :]:
            if tasks := [task for task in a.scored_tasks if task in b.scored_tasks]:
                rng = stream(0, f"bench improvement {a.method} {a.demos} {b.method} {b.demos}")
                found.append((a, b, tasks, improvement(a.scores(tasks), b.scores(tasks), rng)))
    return found


def scorer(result: Result) -> Callable[[float | int], float]:
    """A return of the result's task as a normalised score; NaN where its ends are not known."""
    random, expert = result.get("random_return"), result.get("expert_return")
    if (random is None or expert is None) and (card := shelf.expert_card(result["task"])):
        random, expert = card.random_return_mean, card.measured.return_mean
    return lambda value: normalised_score(value, random, expert)


def speed(results: Sequence[Result]) -> list[tuple[float | None, float | None]]:
    """Median steps and seconds to each of `SHARES`; None where half of the seeds or more never got there."""
    found = []
    for share in SHARES:
        steps = [steps_to(result["curve"], share, scorer(result)) for result in results]
        seconds = [_seconds(r, at) for r, at in zip(results, steps, strict=True)]
        found.append((middle(steps), middle(seconds)))
    return found


def _seconds(result: Result, steps: float | None) -> float | None:
    """Of a run, until it had done these steps."""
    if steps is None:
        return None
    at = [row[0] for row in result["curve"]]
    if "curve_s" in result:
        return result["curve_s"][at.index(steps)]
    # what was written without them: as if it went at one pace
    return result["wall_s"] * steps / at[-1]
