"""What a grid will cost: steps a second of runs that were measured, times steps."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from irl.bench.cells import Cell
from irl.core import files
from irl.core.errors import UserError

# Measured on 2 cores of an AMD EPYC or Intel Xeon with other work beside (scripts/benchmarks/RESULTS.md);
# of bc, gradient steps; those of TD3 are guessed from SAC's.
BY_METHOD = {"gail": 1900.0, "airl": 2000.0, "bc": 400.0}
BY_METHOD |= dict.fromkeys(("dac", "gail-sac", "airl-sac"), 47.0) | dict.fromkeys(
    ("dac-td3", "gail-td3"), 60.0
)
BY_ALGO = {"ppo": 2300.0, "sac": 55.0}
PEER = 1200.0

Key = tuple[str, str]
"""An arm and a task."""


@dataclass(frozen=True)
class Cost:
    """Of one cell, on one core."""

    cell: Cell
    steps_per_s: float
    source: str
    """Where the speed is from."""

    @property
    def seconds(self) -> float:
        return self.cell.steps / self.steps_per_s


def measured(results: Iterable[Mapping[str, Any]]) -> dict[Key, float]:
    """Median steps a second of finished runs, by arm and task, and by arm alone under the task ''."""
    found: dict[Key, list[float]] = {}
    for result in results:
        rate = result["env_steps"] / result["wall_s"]
        for task in (result["task"], ""):
            found.setdefault((result["method"], task), []).append(rate)
    return {key: median(rates) for key, rates in found.items()}


def costs(cells: Sequence[Cell], rates: Mapping[Key, float]) -> list[Cost]:
    """Of each cell, by the nearest run that was measured."""
    return [Cost(cell, *_rate(cell, rates)) for cell in cells]


def _rate(cell: Cell, rates: Mapping[Key, float]) -> tuple[float, str]:
    for key, source in (
        ((cell.arm, cell.task), "measured"),
        ((cell.method, cell.task), f"{cell.method} there"),
        ((cell.arm, ""), "on other tasks"),
    ):
        if key in rates and (cell.kind == "train" or key[0] == cell.arm):
            return rates[key], source
    if cell.kind == "retrain":
        return BY_ALGO[cell.algo], "a guess"
    return (PEER if cell.kind == "peer" else BY_METHOD.get(cell.method, PEER)), "a guess"


def makespan(costs: Sequence[Cost], workers: int) -> float:
    """Seconds until all is done: each cell in its order to whoever is free first, a reward before its use.

    Whoever takes a retraining waits for the run whose reward it is.
    """
    free, ended = [0.0] * max(workers, 1), dict[str, float]()
    for cost in sorted(costs, key=lambda cost: bool(cost.cell.source)):
        i = min(range(len(free)), key=free.__getitem__)
        begun = max(free[i], ended.get(cost.cell.source, 0.0))
        free[i] = ended[cost.cell.name] = begun + cost.seconds
    return max(free)


def all_results(root: Path) -> list[dict[str, Any]]:
    """Every result with a speed, of any grid: the more there are, the less is guessed."""
    found = []
    for path in sorted(root.glob("*/*.json")):
        try:
            content = files.read_json(path)
        except UserError:
            # that of a table says so; an estimate goes without it
            continue
        if isinstance(content, dict) and all(content.get(name) for name in ("method", "task", "env_steps")):
            found += [content] if content.get("wall_s") else []
    return found
