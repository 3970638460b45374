"""What a grid came to, as the section of RESULTS.md that its JSON makes."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from irl.bench.arms import SHARES, Arm, arm_averages, arms_of, comparisons, speed
from irl.bench.cells import Cell
from irl.bench.grid import Grid
from irl.bench.statistics import DRAWS
from irl.bench.typeset import bare, estimate, short, table, thousands
from irl.core.statistics import FEW

LISTED = 8
"""Commands, machines or missing cells that are named; the rest is counted."""
Result = Mapping[str, Any]


def section(
    name: str,
    results: Sequence[Result],
    grid: Grid | None,
    cells: Sequence[Cell],
    notes: Sequence[str] = (),
) -> str:
    """Averages, each run, which method is better, rewards, and what none of it shows.

    Args:
        grid: None where the results are of no grid that is there.
        cells: those of the grid, whether or not they have a result.
        notes: what else a reader has to know, as `comparable` says it.
    """
    arms = arms_of(results)
    parts = [
        f"### `{name}`" + (f": {grid.title}" if grid and grid.title else ""),
        _commands(name, results, grid),
        _provenance(results),
        averages_table(arms),
        _too_narrow(arms),
        _runs_table(arms),
        _comparison_table(arms),
        _reward_table(arms),
        _not_shown(results, grid, cells, notes),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def summary(name: str, results: Sequence[Result], grid: Grid | None, figure: str) -> str:
    """What of it stands in README: the averages and the curves."""
    said = grid.title if grid and grid.title else name
    shown = f"![Score against steps of each method, a panel a task]({figure})"
    said = said[:1].upper() + said[1:]
    made = f"*{said}. Made by `irl bench {name}`; every run and what this does not show: RESULTS.md.*"
    parts = [averages_table(arms := arms_of(results)), _too_narrow(arms), shown, made]
    return "\n\n".join(part for part in parts if part) + "\n"


def averages_table(arms: Sequence[Arm]) -> str:
    """Interquartile mean and mean of the normalised score."""
    rows = []
    for arm in arms:
        middle, mean = arm_averages(arm)
        steps = " / ".join(sorted({f"{r['env_steps']:,}" for r in arm.runs}))
        tasks = ", ".join(bare(task) for task in arm.scored_tasks)
        scored = sum(map(len, arm.scores(arm.scored_tasks)))
        rows.append((arm.method, arm.demos, steps, tasks, scored, estimate(middle), estimate(mean)))
    heads = ("method", "episodes", "steps", "tasks", "runs", "IQM of the score (95 %)", "mean (95 %)")
    return table(heads, rows)


def _too_narrow(arms: Sequence[Arm]) -> str:
    """What the intervals are worth, where there are any and some task has few seeds."""
    seeds = [len(scores) for arm in arms for scores in arm.scores(arm.scored_tasks)]
    if not any(1 < n < FEW for n in seeds):
        return ""
    return (
        f"Intervals over fewer than {FEW} seeds a task are too narrow: simulated with Gaussian scores and 3 "
        f"seeds a task, one of 95 % for the mean held it in 85 % of cases with five tasks, in 75 % with one."
    )


def _runs_table(arms: Sequence[Arm]) -> str:
    """Every run's score, and how soon the curves were there."""
    shares = ", ".join(short(share, 1) for share in SHARES)
    heads = (
        "method",
        "task",
        "seeds",
        "scores",
        "returns",
        "wall-clock",
        f"steps to {shares}",
        f"s to {shares}",
    )
    rows = []
    for arm in arms:
        for task, results in arm.by_task.items():
            there = speed(results)
            rows.append(
                (
                    arm.method + (f", {arm.demos} ep." if _several_demos(arms, arm) else ""),
                    bare(task),
                    " ".join(str(r["seed"]) for r in results),
                    " ".join(short(r["score"]) for r in results),
                    " ".join(f"{r['return_mean']:.0f}" for r in results),
                    " ".join(f"{r['wall_s']:,.0f} s" for r in results),
                    " ".join(thousands(steps) for steps, _ in there),
                    " ".join("-" if s is None else f"{s:,.0f}" for _, s in there),
                )
            )
    return table(heads, rows)


def _several_demos(arms: Sequence[Arm], arm: Arm) -> bool:
    return len({other.demos for other in arms if other.method == arm.method}) > 1


def _comparison_table(arms: Sequence[Arm]) -> str:
    rows = [
        (a.method, a.demos, b.method, b.demos, ", ".join(map(bare, tasks)), estimate(found, 2))
        for a, b, tasks, found in comparisons(arms)
    ]
    heads = ("a run of", "episodes", "is above one of", "episodes", "tasks", "with probability (95 %)")
    return table(heads, rows) if rows else ""


def _reward_table(arms: Sequence[Arm]) -> str:
    """Of grids that retrain: the learned reward itself beside what it teaches."""
    rows = []
    for arm in arms:
        for result in (r for r in arm.runs if "score_of_the_run" in r):
            reward = result.get("reward") or {}
            distance = reward.get("distance") or {}
            weights = ", ".join(
                f"{name} {short(row['standardised'], 2)}" for name, row in reward.get("weights", {}).items()
            )
            scores = short(result["score_of_the_run"]), short(result["score"])
            where = bare(result["task"]), result["seed"], f"{result['snapshot']:,}"
            rows.append((arm.method, *where, short(distance.get("value")), weights or "-", *scores))
    heads = (
        "",
        "task",
        "seed",
        "reward of step",
        "distance",
        "weights at the end",
        "its policy",
        "a fresh one",
    )
    return table(heads, rows) if rows else ""


def _commands(name: str, results: Sequence[Result], grid: Grid | None) -> str:
    said = [f"irl bench {name}"] if grid else _some(result["command"] for result in results)
    return "\n".join(["```", *said, "```"])


def _provenance(results: Sequence[Result]) -> str:
    stretches = [stretch for result in results for stretch in _stretches(result)]
    commits = _some(
        (s.get("commit") or "unknown")[:7] + (" and changes" if s.get("dirty") else "") for s in stretches
    )
    machines = _some(f"{s['machine']}, {s['device']}" for s in stretches if "machine" in s)
    paced = "" if all("curve_s" in r for r in results) else "; of runs that have no clock, at an even pace"
    return (
        f"Commit {', '.join(commits)}; {'; '.join(machines) or 'machine unknown'}; one thread a run. The "
        f"policy at the last step, deterministic; score 0 is random actions, 1 the expert. Intervals: "
        f"{DRAWS:,} resamples of the seeds within each task, left away where a task has one seed. Steps and "
        f"seconds: median over seeds to the first evaluation that is there, `-` where half or more "
        f"never are{paced}."
    )


def _stretches(result: Result) -> list[Result]:
    """The result as its run was begun, and as it was wherever it was gone on with."""
    found: list[Result] = [result]
    for resumed in result.get("resumed", ()):
        made = {f"git_{name}": found[-1].get(name) for name in ("commit", "dirty")} | resumed
        found.append({**found[-1], **made, "commit": made["git_commit"], "dirty": made["git_dirty"]})
    return found


def _not_shown(
    results: Sequence[Result], grid: Grid | None, cells: Sequence[Cell], notes: Sequence[str]
) -> str:
    seeds = [len(of) for arm in arms_of(results) for of in arm.by_task.values()]
    least, most = min(seeds), max(seeds)
    few = str(most) if least == most else f"{least} to {most}"
    said = [f"{few} seed{'s' if most > 1 else ''} a method and task: no claim about rare failures."]
    there = {result["file"].removesuffix(".json") for result in results}
    if missing := [cell.name for cell in cells if cell.name not in there]:
        said.insert(0, f"{len(missing)} of {len(cells)} cells have no result: {', '.join(_some(missing))}.")
    said += notes
    said.append("Seconds are of machines with other work beside, so they compare within this table at best.")
    said += grid.not_shown if grid else ()
    return "\n".join(["What this does not show:", "", *(f"- {sentence}" for sentence in said)])


def _some(words: Iterable[str]) -> list[str]:
    """Each once, at most `LISTED`."""
    once = list(dict.fromkeys(words))
    return once if len(once) <= LISTED else [*once[:LISTED], f"and {len(once) - LISTED} more"]
