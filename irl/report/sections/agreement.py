"""The learned reward against the hand-written one: a honeycomb, lines, and where the two differ most."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from irl.report import plots
from irl.report.folder import RunFiles, finite, lookup
from irl.report.palette import BLUES, DASHES, PLAY, STRATA, framed
from irl.report.panel import Panel, Table, View, plain, unmeasured


def agreement(run: RunFiles) -> Panel:
    """Over segments with shaping off, and step by step."""
    anchor, title = "against", "Learned against hand-written reward"
    found = {unit: lookup(run.evaluation, f"drift.pictures.against.{unit}") for unit in ("segment", "step")}
    whole = {unit: rows for unit, rows in found.items() if _whole(rows)}
    if not whole:
        return _older(run, anchor, title)
    n = lookup(whole.get("segment"), "n")
    names = {"segment": f"segments of {n} steps, shaping taken off", "step": "single steps, as they are"}
    views = tuple(View(names[unit], (honeycomb(rows, unit),)) for unit, rows in whole.items())
    text = (
        "A hexagon holds the probe steps that fall into it; a line is one kind of play. Where all lines rise "
        "alike the learned reward wants what the hand-written one wants; a flat or falling line is a kind of "
        "play that it misjudges. Single steps scatter by shaping, which changes no policy."
    )
    tables = tuple(table for table in (_slopes(whole), _residuals(run)) if table is not None)
    return Panel(anchor, title, text, "against", views, tables=tables, notes=_notes(run))


def honeycomb(rows: Mapping[str, Any], unit: str) -> go.Figure:
    """Counts of all kinds of play together, and their lines."""
    counts: dict[tuple[float, float], int] = {}
    for row in rows["strata"].values():
        for x, y, size in zip(row["hex_x"], row["hex_y"], row["hex_count"], strict=True):
            counts[x, y] = counts.get((x, y), 0) + size
    drawn = go.Figure()
    powers = range(int(math.log10(max(counts.values()))) + 1)
    drawn.add_scatter(
        x=[x for x, _ in counts],
        y=[y for _, y in counts],
        mode="markers",
        customdata=list(counts.values()),
        showlegend=False,
        name="steps",
        marker={
            "symbol": "hexagon",
            "size": 11,
            "color": [math.log10(size) for size in counts.values()],
            "colorscale": BLUES,
            "colorbar": {
                "title": {"text": "steps", "side": "right"},
                "thickness": 10,
                "tickvals": list(powers),
                "ticktext": [f"{10**p:,}" for p in powers],
            },
        },
        hovertemplate="hand-written %{x:.3g}<br>learned %{y:.3g}<br>%{customdata} steps<extra></extra>",
    )
    for name, row in rows["strata"].items():
        slope, offset, ends = finite(row.get("slope")), finite(row.get("intercept")), row.get("range")
        if slope is None or offset is None or not isinstance(ends, list):
            continue
        drawn.add_scatter(
            x=ends,
            y=[slope * x + offset for x in ends],
            mode="lines",
            name=f"{plain(name)}: slope {slope:.2g}",
            line={"color": PLAY.get(name, STRATA["random"]), "width": 3, "dash": DASHES.get(name, "solid")},
            hoverinfo="skip",
        )
    what = f"of a {unit}"
    framed(drawn, f"hand-written, {what}", f"learned, {what} (nats)", height=470)
    return drawn.update_layout(meta={"across": rows["across"], "x": rows["x"]})


def _whole(rows: object) -> bool:
    strata = lookup(rows, "strata")
    if not isinstance(strata, Mapping) or not isinstance(lookup(rows, "across"), int):
        return False
    ends = lookup(rows, "x")
    if not isinstance(ends, list) or len(ends) != 2 or None in map(finite, ends):
        return False
    return any(_cells(row) for row in strata.values()) and all(
        _cells(row) is not None for row in strata.values()
    )


def _cells(row: object) -> int | None:
    """How many hexagons a kind of play has; None where they are damaged."""
    columns = [lookup(row, key) for key in ("hex_x", "hex_y", "hex_count")]
    if not all(isinstance(c, list) and all(finite(v) is not None for v in c) for c in columns):
        return None
    ends = lookup(row, "range")
    if ends is not None and (not isinstance(ends, list) or None in map(finite, ends)):
        return None
    sizes = {len(c) for c in columns if isinstance(c, list)}
    return sizes.pop() if len(sizes) == 1 and all(v > 0 for v in columns[2] or ()) else None


def _slopes(whole: Mapping[str, Mapping[str, Any]]) -> Table:
    keys = ("slope", "low", "high", "pearson", "size", "episodes")
    rows = [
        (f"{name}, {unit}s", *(finite(row.get(key)) for key in keys))
        for unit, found in whole.items()
        for name, row in found["strata"].items()
    ]
    return Table(
        ("kind of play", "slope", "95 % low", "high", "Pearson", "points", "episodes"), rows, "The lines"
    )


def _residuals(run: RunFiles) -> Table | None:
    found = lookup(run.evaluation, "drift.pictures.residuals.rows")
    rows = [row for row in found if isinstance(row, Mapping)] if isinstance(found, list) else []
    if not rows:
        return None
    first = rows[0].get("terms")
    terms = [str(name) for name in first] if isinstance(first, Mapping) else []
    shown = [
        (
            f"{row.get('stratum')}, episode {row.get('episode')}, step {row.get('step')}"
            + (", ends the episode" if row.get("ends") is True else ""),
            *(finite(row.get(key)) for key in ("residual", "learned", "expected", "hand_written")),
            *(finite(lookup(row, f"terms.{name}")) for name in terms),
            _vector(row.get("action")),
            _vector(row.get("obs")),
        )
        for row in rows
    ]
    head = ("step", "residual (std)", "learned", "expected", "hand-written", *terms, "action", "observation")
    return Table(
        head,
        shown,
        "Largest disagreements: the steps furthest from one line through all, two an episode at most",
        folded=True,
    )


def _vector(values: object) -> str:
    numbers = [finite(v) for v in values] if isinstance(values, list) else []
    return " ".join("?" if v is None else f"{v:.3g}" for v in numbers)


def _notes(run: RunFiles) -> tuple[str, ...]:
    r, rho = (finite(lookup(run.evaluation, f"reward.{name}")) for name in ("pearson", "spearman"))
    if r is None or rho is None:
        return ()
    return (f"Step by step over expert, policy and random play: Pearson {r:.2f}, Spearman {rho:.2f}.",)


def _older(run: RunFiles, anchor: str, title: str) -> Panel:
    """Evaluations with points in place of counts."""
    columns: list[Sequence[Any]] = []
    for name in ("learned", "hand_written", "stratum"):
        values = lookup(run.evaluation, f"reward.scatter.{name}")
        columns.append(values if isinstance(values, list) else [])
    learned, hand_written, stratum = columns
    if not (learned and hand_written and len(learned) == len(hand_written) == len(stratum)):
        known = finite(lookup(run.evaluation, "reward.pearson")) is not None
        return unmeasured(run, anchor, title, "reward.scatter" if known else "reward.pearson")
    text = (
        "A rising cloud means that the learned reward ranks steps as the hand-written one does; one that "
        "differs by shaping alone can scatter here and still want the same policy."
    )
    drawn = plots.learned_against_hand_written(learned, hand_written, stratum)
    return Panel(anchor, title, text, "against", (View("", (drawn,)),), notes=_notes(run))
