"""What a section of the page is made of: views of figures, tables, and what to see in them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import plotly.graph_objects as go

from irl.report.folder import RunFiles, lookup, why_missing

Cell = str | float | int | None


@dataclass(frozen=True)
class Table:
    """Numbers in rows; the first column names the row."""

    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    folded: bool = False
    """Long and for the few: the caption opens it, and a row is one line."""


@dataclass(frozen=True)
class View:
    """One setting of a tab or a slider, and the figures it shows, side by side where there is room."""

    label: str
    figures: tuple[go.Figure, ...] = ()
    html: str = ""
    """Markup of its own, in which every string of a file is escaped already."""


@dataclass(frozen=True)
class Panel:
    """One section of the page. Where `missing`, `text` is the reason and what to type."""

    anchor: str
    title: str
    text: str
    how: str = ""
    """Which entry of `irl.report.how` says how it is calculated."""
    views: tuple[View, ...] = ()
    control: Literal["tabs", "slider"] = "tabs"
    control_label: str = ""
    chosen: int = 0
    """Which view is shown first."""
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
    html: str = ""
    """Likewise, below the views; a link in it to another section names the anchor alone."""
    data: dict[str, Any] = field(default_factory=dict)
    """What a script of the section reads, by name."""
    missing: bool = False


def one(figure: go.Figure) -> tuple[View, ...]:
    """A single figure, without a control."""
    return (View("", (figure,)),)


def absent(anchor: str, title: str, reason: str, command: str = "") -> Panel:
    """A section that is named as missing, with what to type."""
    text = f"Not shown: {reason.rstrip('.')}." + (f" To have it: {command}" if command else "")
    return Panel(anchor, title, text, missing=True)


def unmeasured(run: RunFiles, anchor: str, title: str, path: str) -> Panel:
    """A section that evaluation.json has nothing of, with the reason that it gives, or what to type."""
    command = f"irl evaluate {run.name}"
    if not run.evaluation:
        reason = run.problems.get("evaluation.json", "this run has no evaluation yet")
        return absent(anchor, title, reason, command)
    if lookup(run.evaluation, path.split(".")[0]) is None:
        told = why_missing(run.evaluation, path)
        if told.startswith("evaluation.json gives neither"):
            return absent(anchor, title, "this evaluation was written without it", command)
        return absent(anchor, title, told)
    return absent(
        anchor,
        title,
        lookup(run.evaluation, f"{path.split('.')[0]}.reason") or why_missing(run.evaluation, path),
    )


def plain(text: object) -> str:
    """A string of a file as a figure shows it: plotly follows some markup in its labels."""
    return str(text).translate(str.maketrans("<>&", "()+"))
