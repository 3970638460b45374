"""Where the snapshots lie: the distance of each to each and to the hand-written reward, for several n."""

from collections.abc import Mapping
from typing import Any

import plotly.graph_objects as go

from irl.report.folder import RunFiles, finite, lookup
from irl.report.palette import ACCENT, BLUES, GRID, INK, STRATA, framed
from irl.report.panel import Panel, Table, View, unmeasured
from irl.report.plots import short, tiles

TRUTH = "hand-written"


def maps(run: RunFiles) -> Panel:
    """Heat map and path, with a slider over n; and the distances of the last snapshot as a table."""
    anchor, title = "map", "Snapshot map"
    steps = lookup(run.evaluation, "drift.pictures.snapshots")
    found = lookup(run.evaluation, "drift.pictures.maps")
    whole = [row for row in found if _whole(row, steps)] if isinstance(found, list) else []
    curve = _curve(run)
    if not whole:
        gone = unmeasured(run, anchor, title, "drift.pictures.maps")
        return gone if curve is None else Panel(anchor, title, gone.text, "val", tables=(curve,))
    names = [short(float(step)) for step in steps] + [TRUTH]
    views = tuple(
        View(_label(row["n"]), (heat(row["matrix"], names), path(row["map"], names))) for row in whole
    )
    chosen = next((i for i, row in enumerate(whole) if row["n"] == 50), 0)
    text = (
        "The heat map is the distance of every two snapshots, 0 the same, 1 the opposite, with the "
        "hand-written reward in the last row; the path is the same in a plane: a reward that is "
        "learning walks towards the star and stops; "
        "one that goes round, or stops far away, has not found it. Longer segments forgive shaping."
    )
    return Panel(
        anchor, title, text, "map", views, "slider", "compared over", chosen, tables=(curve,) if curve else ()
    )


def heat(matrix: list[list[Any]], names: list[str]) -> go.Figure:
    """Distances of all pairs."""
    places = list(range(len(names)))
    pairs = [[f"{a} and {b}" for b in names] for a in names]
    drawn = tiles(matrix, pairs, BLUES, "%{customdata}: %{z:.3f}<extra></extra>", "distance")
    framed(drawn, "snapshot (environment steps)", "", height=430)
    every = max(1, -(-len(names) // 10))
    shown = sorted({*places[::every], places[-1]} - ({places[-2]} if len(names) > 10 else set()))
    ticks = {"tickvals": shown, "ticktext": [names[i] for i in shown], "showgrid": False}
    return drawn.update_xaxes(**ticks, tickangle=-50).update_yaxes(**ticks, autorange="reversed")


def path(places: list[list[Any]], names: list[str]) -> go.Figure:
    """The plane, with the snapshots in order and the hand-written reward as a star."""
    known = [(x, y, name) for (x, y), name in zip(places[:-1], names[:-1], strict=True) if x is not None]
    drawn = go.Figure()
    x, y, labels = ([row[i] for row in known] for i in range(3))
    drawn.add_scatter(
        x=x,
        y=y,
        customdata=labels,
        mode="lines+markers",
        name="snapshots, stronger is later",
        line={"color": INK, "width": 1},
        marker={
            "size": 10,
            "color": list(range(len(known))),
            "colorscale": BLUES,
            "line": {"color": STRATA["expert"], "width": 1},
        },
        hovertemplate="step %{customdata}<extra></extra>",
    )
    for i, where in ((0, "bottom center"), (-1, "top center")):
        if known:
            drawn.add_scatter(
                x=[x[i]],
                y=[y[i]],
                mode="text",
                text=[labels[i]],
                textposition=where,
                showlegend=False,
                hoverinfo="skip",
            )
    star = places[-1]
    if star[0] is not None:
        look = {"symbol": "star", "size": 17, "color": ACCENT}
        drawn.add_scatter(x=[star[0]], y=[star[1]], mode="markers", name="hand-written reward", marker=look)
        drawn.data[-1].hovertemplate = "hand-written reward<extra></extra>"
    framed(drawn, "distance (first axis)", "distance (second axis)", height=430)
    drawn.update_xaxes(showgrid=True, gridcolor=GRID, showline=False)
    return drawn.update_yaxes(scaleanchor="x", scaleratio=1)


def _label(n: int) -> str:
    return "whole episodes" if n == 0 else f"{n} step{'s' * (n != 1)}"


def _whole(row: object, steps: object) -> bool:
    """Whether a map has as many rows, columns and places as there are snapshots, and one more."""
    if not isinstance(row, Mapping) or not isinstance(steps, list) or not isinstance(row.get("n"), int):
        return False
    if not all(finite(step) is not None for step in steps):
        return False
    size = len(steps) + 1
    matrix, places = row.get("matrix"), row.get("map")
    return all(
        isinstance(grid, list)
        and len(grid) == size
        and all(isinstance(r, list) and len(r) == n for r in grid)
        and all(v is None or finite(v) is not None for r in grid for v in r)
        for grid, n in ((matrix, size), (places, 2))
    )


def _curve(run: RunFiles) -> Table | None:
    """The last snapshot's distance to the hand-written reward, with self-tests."""
    rows = [
        row for path in ("curve", "references") for row in _list(lookup(run.evaluation, f"distances.{path}"))
    ]
    if not rows:
        return None
    keys = ("low", "high", "self_error", "random")
    shown = [(_name(row), _value(row), *(finite(row.get(key)) for key in keys)) for row in rows]
    head = ("last snapshot", "distance", "95 % low", "high", "own error", "of a random reward")
    return Table(head, shown, "Distance of the last snapshot to the hand-written reward")


def _name(row: Mapping[str, Any]) -> str:
    n = row.get("n")
    return f"{row.get('name')} over {_label(n)}" if isinstance(n, int) else str(row.get("name"))


def _value(row: Mapping[str, Any]) -> str | float | None:
    if isinstance(row.get("reason"), str):
        return f"undefined: {row['reason']}"
    return "not distinguishable" if row.get("distinguishable") is False else finite(row.get("value"))


def _list(rows: object) -> list[Mapping[str, Any]]:
    return [row for row in rows if isinstance(row, Mapping)] if isinstance(rows, list) else []
