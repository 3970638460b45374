"""`irl report`: the page of one run or of several, from their folders alone."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from irl.core import files
from irl.core.config import check_at_least
from irl.core.errors import UserError
from irl.report.html import write_reports

WATCHED = ("config.json", "metrics.jsonl", "evaluation.json", "retrained.json", "retrain.json")
"""Files of a run folder whose change is a reason to write the page again."""


@dataclass(frozen=True)
class Report:
    """Write one page of a run, or of several beside each other; needs no network to be read."""

    runs: tyro.conf.Positional[tuple[Path, ...]]
    """Run folders."""
    out: Path | None = None
    """File; RUN/report.html of one run, report.html here of several, unless given."""
    watch: bool = False
    """Write it again whenever a run has gone on, until Ctrl-C; the open page reads itself again."""
    every: int = 10
    """Seconds between two looks, with --watch."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "every")
        if not self.runs:
            raise ValueError("name one run folder or more")


def report(command: Report) -> None:
    """Write, print where; with `watch`, go on until interrupted.

    Raises:
        UserError: a folder is not there.
    """
    for run in command.runs:
        if not run.is_dir():
            raise UserError(f"there is no run folder {run}: give the folder that `irl train` wrote")
    target = command.out or (
        command.runs[0] / "report.html" if len(command.runs) == 1 else Path("report.html")
    )
    files.check_writable(target)
    write_reports(command.runs, target, command.every if command.watch else None)
    Console().print(f"report: {target}", highlight=False, markup=False, soft_wrap=True)
    if command.watch:
        _watch(command, target)


def _watch(command: Report, target: Path) -> None:
    before = changed_at(command.runs)
    try:
        while True:
            time.sleep(command.every)
            if (now := changed_at(command.runs)) != before:
                before = now
                write_reports(command.runs, target, command.every)
    finally:
        # the last page is one that stands still
        write_reports(command.runs, target)


def changed_at(runs: Sequence[Path]) -> tuple[tuple[int, int], ...]:
    """When each watched file last changed, and its size; zeros where there is none."""
    found = []
    for path in (run / name for run in runs for name in WATCHED):
        try:
            status = path.stat()
            found.append((status.st_mtime_ns, status.st_size))
        except OSError:
            found.append((0, 0))
    return tuple(found)
