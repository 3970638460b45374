"""The table that a person watches while a grid runs: a table on a terminal, a line now and then elsewhere."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from rich import box
from rich.console import Console
from rich.live import Live
from rich.table import Table

from irl.bench.estimate import Cost, makespan
from irl.bench.progress import Progress, progress_of
from irl.bench.schedule import State, outcome_line
from irl.policies import shelf

QUIET_S = 60.0
"""Seconds between two lines where there is no terminal."""
Look = Callable[[State], None]


@contextmanager
def live(costs: Sequence[Cost], runs: Path, workers: int) -> Iterator[Look]:
    """What to call with the state now and then."""
    console = Console(stderr=True)
    expert_card = cache(shelf.expert_card)

    def read(state: State) -> dict[str, Progress]:
        return {name: progress_of(cell, runs, expert_card(cell.task)) for name, cell in state.running.items()}

    if not console.is_terminal:
        yield _lines(console, costs, read, workers)
        return
    with Live(console=console, refresh_per_second=2) as shown:
        yield lambda state: shown.update(table(state, read(state), costs, workers))


def table(state: State, read: Mapping[str, Progress], costs: Sequence[Cost], workers: int) -> Table:
    """Cell, progress, steps a second, score and time left of what runs; what failed, and why."""
    drawn = Table(box=box.SIMPLE_HEAD, caption_justify="left")
    for name in ("cell", "progress", "steps/s", "score", "left"):
        drawn.add_column(name, justify="left" if name == "cell" else "right", no_wrap=name != "cell")
    for name, cell in state.running.items():
        at = read[name]
        left = (cell.steps - at.steps) / at.steps_per_s if at.steps_per_s else None
        drawn.add_row(
            name,
            f"{min(at.steps / cell.steps, 1):.0%}",
            "-" if at.steps_per_s is None else f"{at.steps_per_s:,.0f}",
            "-" if at.score is None else f"{at.score:.3f}",
            duration(left),
        )
    for name, why in state.failed.items():
        drawn.add_row(name, "failed", "", "", f"{why:.60}")
    left = seconds_left(state, read, costs, workers)
    drawn.caption = f"{outcome_line(state)}, {duration(left)} left"
    return drawn


def seconds_left(
    state: State, read: Mapping[str, Progress], costs: Sequence[Cost], workers: int
) -> float | None:
    """Of all that is still to do: what runs by its own speed, what waits by the estimate."""
    ahead = []
    for cost in costs:
        name = cost.cell.name
        if name in state.done or name in state.failed:
            continue
        at = read.get(name, Progress())
        speed = at.steps_per_s or cost.steps_per_s
        # as the cost of a cell that is as long as what is left of this one
        ahead.append(Cost(cost.cell, speed / max(1 - at.steps / cost.cell.steps, 1e-9), cost.source))
    return makespan(ahead, workers) if ahead else None


def duration(seconds: float | None) -> str:
    """To be read at a glance.

    >>> duration(42.0), duration(5000.0), duration(200_000.0)
    ('42 s', '1 h 23 min', '55 h 33 min')
    """
    if seconds is None:
        return "-"
    if seconds < 100:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"


def _lines(
    console: Console, costs: Sequence[Cost], read: Callable[[State], dict[str, Progress]], workers: int
) -> Look:
    said, before = -QUIET_S, (-1, -1)

    def look(state: State) -> None:
        nonlocal said, before
        ended = len(state.done), len(state.failed)
        if ended == before and time.monotonic() - said < QUIET_S:
            return
        said, before = time.monotonic(), ended
        at = read(state)
        left = duration(seconds_left(state, at, costs, workers))
        console.print(f"{outcome_line(state)}, {left} left", highlight=False, soft_wrap=True)
        for name, cell in state.running.items():
            score = at[name].score
            words = "" if score is None else f", score {score:.3f}"
            console.print(f"  {name} {at[name].steps:,} of {cell.steps:,}{words}", highlight=False)

    return look
