"""What each switch does to one seed: GAIL with PPO and DAC, with it and without, resumed cell by cell.

    python scripts/benchmarks/switches.py
    python scripts/benchmarks/switches.py --only mixup dropout --methods dac --tasks Hopper-v5
    python scripts/benchmarks/switches.py --table

A cell is a JSON in results/switches; one that is there is not run again, and a run that was stopped goes on.
The score is that of the deterministic policy at the last step, 20 episodes. One seed: see SWITCHES.md.
"""

import json
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import methods
import tyro

from irl.envs.tasks import task_name

RESULTS = Path(__file__).parent / "results" / "switches"
STEPS = {"gail": 200_000, "dac": 50_000}
_D = "--discriminator."
SWITCHES: dict[str, str] = {
    "off": "",
    "pu": f"{_D}loss pu",
    "wasserstein": f"{_D}loss wasserstein {_D}reward-map logit",
    "label-smoothing": f"{_D}label-smoothing 0.1",
    "mixup": f"{_D}mixup 1",
    "dropout": f"{_D}dropout 0.5",
    "weight-decay": f"{_D}weight-decay 1",
    "lr-decay": f"{_D}lr-schedule linear",
    "no-penalty": f"{_D}gradient-penalty 0",
    "zero-centred": f"{_D}penalty-center 0",
    "spectral-norm": f"{_D}spectral-norm",
    "entropy": f"{_D}entropy 0.01",
    "states": f"{_D}inputs obs",
    "state-pairs": f"{_D}inputs obs_next_obs",
    "steps": f"{_D}inputs obs_action_next_obs",
    "ensemble-mean": f"{_D}ensemble 3",
    "ensemble-lowest": f"{_D}ensemble 3 {_D}ensemble-reward lowest",
    "reward-clip": "--learner.reward-clip 5",
    "subsampled": "--demo-rate 20",
    "warm-start": "--warm-start.updates 5000",
}
"""Words for `irl train`, by name."""
OF_ONE = {
    "gail": {"unscaled": "--learner.reward-scaling none", "logit": f"{_D}reward-map logit"},
    "dac": {"scaled": "--learner.reward-scaling std", "gail-map": f"{_D}reward-map gail", "td3": ""},
}
"""The same, of settings whose defaults differ."""
COMMANDS = {"td3": "dac-td3"}
"""`irl train` commands of switches that are no words for a method's own."""


@dataclass(frozen=True)
class Settings:
    """Which cells to run."""

    methods: tuple[str, ...] = ("gail", "dac")
    """Names of `irl train` commands."""
    tasks: tuple[str, ...] = ("Hopper-v5", "HalfCheetah-v5")
    """Gymnasium ids."""
    only: tuple[str, ...] = ()
    """Names of switches; all where none is given."""
    seed: int = 1
    """The one seed."""
    steps: int | None = None
    """Environment steps of each run; 200,000 of gail and 50,000 of dac unless given."""
    extra: str = ""
    """More words for `irl train`; they are written into the result."""
    runs: Path = Path("runs/switches")
    """Where the run folders are."""
    out: Path = RESULTS
    """Where the results go, as <method>/<task>/<switch>.json."""
    table: bool = False
    """Print the table of the results that are there, and run nothing."""

    def __post_init__(self) -> None:
        if unknown := set(self.methods) - set(STEPS):
            raise ValueError(f"unknown methods {sorted(unknown)}; there are: {', '.join(STEPS)}")
        known = {name for method in self.methods for name in cells(method)}
        if unknown := set(self.only) - known:
            raise ValueError(f"unknown switches {sorted(unknown)}; there are: {', '.join(sorted(known))}")


def cells(method: str) -> dict[str, str]:
    """The switches of a method."""
    return SWITCHES | OF_ONE[method]


def cell(settings: Settings, method: str, task: str, switch: str) -> dict[str, Any]:
    """Train with one switch, or go on training, and judge the policy at the last step."""
    root = settings.runs / "datasets"
    methods.demonstrations(task, root)
    run = settings.runs / f"{method}-{task_name(task)}-{switch}"
    steps, extra = _asked(settings, method, switch)
    command: Any = COMMANDS.get(switch, method)
    asked = methods.Settings(command, (task,), (settings.seed,), steps, extra)
    given = ("--env-id", task, "--demo-episodes", "5", "--steps", str(steps), "--seed", str(settings.seed))
    methods.begin_or_resume("train", run, command, *given, "--datasets-root", str(root), *shlex.split(extra))
    methods.irl("evaluate", str(run))
    return {"switch": switch, **methods.result(asked, task, settings.seed, run)}


def _asked(settings: Settings, method: str, switch: str) -> tuple[int, str]:
    """Environment steps of a cell, and its words for `irl train`."""
    return settings.steps or STEPS[method], f"{cells(method)[switch]} {settings.extra}".strip()


def table(settings: Settings) -> str:
    """Scores by switch, a column a method and task; a cell that is not there is a dash."""
    columns = [(method, task) for method in settings.methods for task in settings.tasks]
    names = list(dict.fromkeys(name for method in settings.methods for name in cells(method)))
    lines = [
        "| switch | " + " | ".join(f"{method} {task}" for method, task in columns) + " |",
        "|---|" + "---|" * len(columns),
    ]
    for name in names:
        files = [settings.out / method / task_name(task) / f"{name}.json" for method, task in columns]
        scores = [json.loads(file.read_text())["score"] if file.is_file() else None for file in files]
        shown = ["–" if score is None else f"{score:.3f}" for score in scores]
        lines.append(f"| {name} | {' | '.join(shown)} |")
    return "\n".join(lines)


def main(settings: Settings) -> None:
    """Run every cell that has no result yet, then print the table."""
    todo = [
        (method, task, switch)
        for method in settings.methods
        for task in settings.tasks
        for switch in cells(method)
        if not settings.table and (not settings.only or switch in settings.only)
    ]
    for method, task, switch in todo:
        file = settings.out / method / task_name(task) / f"{switch}.json"
        if file.is_file():
            steps, extra = _asked(settings, method, switch)
            methods.check_settings(file, task=task, seed=settings.seed, steps=steps, extra=extra)
        else:
            row = cell(settings, method, task, switch)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(row, indent=1) + "\n")
            print(f"{method} {task} {switch}: {row['score']}", flush=True)
    print(table(settings))


if __name__ == "__main__":
    main(tyro.cli(Settings))
