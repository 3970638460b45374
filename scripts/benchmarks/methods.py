"""What a method reaches: one run a task and seed, resumed where it was stopped, each as one JSON.

    python scripts/benchmarks/methods.py dac --tasks Hopper-v5 Walker2d-v5 --steps 150000 --seeds 1 2 3

Five demonstration episodes of the shelf's expert, the method's own defaults, and the deterministic policy
at the last step in 20 episodes of seeds that neither training nor tuning used. Cells run one after the
other; start it several times with other seeds to use more cores. A cell whose JSON is there is not run
again; one whose run folder is there goes on.
"""

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from irl.core.provenance import command_line
from irl.envs.tasks import task_name
from irl.policies import shelf

RESULTS = Path(__file__).parent / "results"
EPISODES = 25
PLACES = ("--out", "--datasets-root", "--policies-root")
"""Flags that say where things are; what is asked for is the same elsewhere."""
PPO_ROUND = 2048
"""Steps of PPO's rounds unless others are typed."""


Method = Literal["gail", "gail-sac", "gail-td3", "dac", "dac-td3", "airl", "airl-sac"]


@dataclass(frozen=True)
class Settings:
    """Which cells to run."""

    method: Annotated[Method, tyro.conf.Positional]
    """Name of the `irl train` command."""
    tasks: tuple[str, ...] = ("Hopper-v5",)
    """Gymnasium ids."""
    seeds: tuple[int, ...] = (1, 2, 3)
    """Seeds of training; none of them was used to choose a setting."""
    steps: int = 150_000
    """Environment steps of each run."""
    extra: str = ""
    """More words for `irl train`; they are written into the result."""
    runs: Path = Path("runs/benchmarks")
    """Where the run folders are."""
    out: Path = RESULTS
    """Where the results go, as <method>/<task>-s<seed>.json."""


def irl(*words: str) -> None:
    """Run one command of the package."""
    program = "from irl.experiment.cli import main; main()"
    subprocess.run([sys.executable, "-c", program, *words], check=True)


def demonstrations(task: str, root: Path) -> None:
    """The expert's episodes, unless they are there."""
    if not (root / "irl" / task_name(task) / "expert-v0").is_dir():
        words = ("--env-id", task, "--episodes", str(EPISODES), "--seed", "0", "--datasets-root", str(root))
        irl("demos", "generate", *words)


def cell(settings: Settings, task: str, seed: int) -> dict[str, Any]:
    """Train, or go on training, and judge the policy at the last step."""
    root = settings.runs / "datasets"
    demonstrations(task, root)
    run = settings.runs / f"{settings.method}-{task_name(task)}-s{seed}"
    words = ("--env-id", task, "--demo-episodes", "5", "--steps", str(settings.steps), "--seed", str(seed))
    where = ("--datasets-root", str(root))
    begin_or_resume("train", run, settings.method, *words, *where, *shlex.split(settings.extra))
    irl("evaluate", str(run))
    return result(settings, task, seed, run)


def begin_or_resume(command: str, run: Path, *words: str) -> None:
    """`irl COMMAND words --out RUN`, or its resumption where that was begun, by these words alone."""
    words = (*words, "--out", str(run))
    if not (run / "config.json").is_file():
        irl(command, *words)
        return
    begun = json.loads((run / "environment.json").read_text())["command"]
    # the first word is the program
    if _asked(shlex.split(begun)[1:]) != _asked((command, *words)):
        asked = shlex.join((command, *words))
        raise SystemExit(f"{run} was begun by `{begun}`, not by `{asked}`; choose another --runs")
    irl(command, "--resume", str(run))


def _asked(words: Sequence[str]) -> list[str]:
    """What a command says but where things are, in its order; of the run that it retrains on, the name."""
    kept, rest = [], iter(words)
    for word in rest:
        if word in PLACES:
            next(rest, None)
        elif word.partition("=")[0] not in PLACES:
            kept.append(word)
    if kept[:1] == ["retrain"]:
        kept[1:2] = [Path(run).name for run in kept[1:2]]
    return kept


def check_settings(file: Path, **asked: Any) -> None:
    """Stop where a result that is there was made by other settings; what it does not say is not compared."""
    found = json.loads(file.read_text())
    made = found | {"steps": _asked_steps(found, asked["steps"])}
    if other := [f"--{k} {made[k]!r}, not {v!r}" for k, v in asked.items() if k in made and made[k] != v]:
        raise SystemExit(f"{file} was made with {'; '.join(other)}; choose another --out and --runs")


def _asked_steps(found: Mapping[str, Any], steps: int) -> int:
    """The steps that a result was asked for: of one that does not say it, `steps` where they may be."""
    if (said := found.get("steps", found.get("settings", {}).get("steps"))) is not None:
        return said
    # a run ends with a whole round
    typed = re.findall(r"steps[-_]per[-_]round[= ](\d+)", found.get("extra", ""))
    longest = int(typed[-1]) if typed else PPO_ROUND
    played = found.get("env_steps", steps)
    return steps if steps <= played < steps + longest else played


def result(settings: Settings, task: str, seed: int, run: Path) -> dict[str, Any]:
    """What is published of a run."""
    found = json.loads((run / "evaluation.json").read_text())
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    config = json.loads((run / "config.json").read_text())
    environment = json.loads((run / "environment.json").read_text())
    shown = ("schedule", "learner", "discriminator", "demo_episodes", "demo_rate", "steps")
    card = shelf.expert_card(task)
    reward = {name: found["reward"][name] for name in ("pearson", "spearman", "auroc")}
    return {
        "method": settings.method,
        "task": task,
        "seed": seed,
        "demos": config["demo_episodes"],
        "env_steps": found["env_steps"],
        "score": found["policy"]["normalised_score"],
        "return_mean": found["policy"]["return_mean"],
        "return_std": found["policy"]["return_std"],
        "return_min": found["policy"].get("return_min"),
        "random_return": card.random_return_mean if card else None,
        "expert_return": card.measured.return_mean if card else None,
        "reward": reward,
        "curve": [[r["env_steps"], r["eval_return_mean"]] for r in rows if "eval_return_mean" in r],
        "wall_s": round(rows[-1]["wall_s"], 1),
        "settings": {name: config[name] for name in shown},
        "extra": settings.extra,
        "command": f"python scripts/benchmarks/{command_line()}",
        **{k: v for k, v in environment.items() if k != "command"},
    }


def main(settings: Settings) -> None:
    """Run every cell that has no result yet; print and write each."""
    for task in settings.tasks:
        for seed in settings.seeds:
            file = settings.out / settings.method / f"{task_name(task)}-s{seed}.json"
            if file.is_file():
                check_settings(file, task=task, steps=settings.steps, extra=settings.extra)
                print(f"{file} is there", flush=True)
                continue
            row = cell(settings, task, seed)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(json.dumps(row, indent=1) + "\n")
            hidden = ("curve", "settings", "packages")
            print(json.dumps({k: v for k, v in row.items() if k not in hidden}), flush=True)


if __name__ == "__main__":
    main(tyro.cli(Settings))
