"""What a person sees while it trains: a bar on a terminal, a line now and then elsewhere."""

import itertools
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from irl.core.metrics import Row
from irl.core.types import Episode

Report = Callable[[int, str], None]
"""Called with how far it is and a few words."""

QUIET_S = 15.0
"""Seconds between two lines where there is no terminal."""


@contextmanager
def progress(what: str, total: int, start: int = 0, show: bool = True) -> Iterator[Report]:
    """Show how far `what` has come of `total`; the block calls the report it is given."""
    console = Console(stderr=True)
    if not show:
        yield lambda done, words: None
    elif console.is_terminal:
        with _bar(console) as bar:
            task = bar.add_task(what, total=total, completed=start, words="")
            yield lambda done, words: bar.update(task, completed=done, words=words)
    else:
        yield _lines(console, what, total, start)


def each_episode(report: Report) -> Callable[[Episode], None]:
    """What a rollout calls with each finished episode, so that `report` shows it with its return."""
    done = itertools.count(1)
    return lambda episode: report(next(done), f"return {episode.return_:.0f}")


def each_step(report: Report, total: int) -> Callable[[Episode], None]:
    """What a rollout calls with each finished episode, so that `report` shows its steps of about `total`."""
    played = 0

    def add(episode: Episode) -> None:
        nonlocal played
        played += len(episode)
        # whole episodes run over a total of steps, and a line is printed at the end
        report(min(played, total - 1), f"return {episode.return_:.0f}")

    return add


def training_words(row: Row, steps_per_s: float) -> str:
    """Steps per second, returns and discriminator accuracy of a row of metrics."""
    words = [f"{steps_per_s:.0f} steps/s"]
    for name, label in (("return_mean", "return"), ("eval_return_mean", "eval")):
        if (value := row.get(name)) is not None:
            words.append(f"{label} {value:.0f}")
    accuracies = [row.get(f"discriminator/accuracy_{side}") for side in ("expert", "policy")]
    known = [value for value in accuracies if value is not None]
    if known:
        words.append(f"D acc {sum(known) / len(known):.2f}")
    return "  ".join(words)


def _bar(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TextColumn("{task.fields[words]}"),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
    )


def _lines(console: Console, what: str, total: int, start: int) -> Report:
    began = time.monotonic()
    said = began

    def report(done: int, words: str) -> None:
        nonlocal said
        now = time.monotonic()
        if done < total and now - said < QUIET_S:
            return
        said = now
        left = (now - began) / max(done - start, 1) * max(total - done, 0)
        console.print(f"{what}  {done}/{total}  {words}  {left:.0f} s left", highlight=False, soft_wrap=True)

    return report
