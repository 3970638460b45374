"""The figures of a report: numbers in, plotly figure out; no file is read and no page is written."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from irl.report.amounts import amount
from irl.report.folder import column, finite
from irl.report.palette import DEMONSTRATIONS, STRATA, STRATUM_NAMES, faded, framed

STEPS = "environment steps"
LINE_POINTS = 2000
"""More points than this on one line are thinned; no screen shows them."""
SCATTER_POINTS = 2000
"""Most points of one stratum in the scatter."""


def learning_curve(metrics: Sequence[Mapping[str, Any]], references: Mapping[str, float]) -> go.Figure:
    """Return against environment steps: training episodes thin, evaluation with markers.

    Args:
        metrics: lines of metrics.jsonl.
        references: return_mean of `expert`, `demonstrations` and `random`, of those that are known.
    """
    figure = go.Figure()
    x, y = thinned(*column(metrics, "env_steps", "return_mean"))
    colour = STRATA["policy"]
    figure.add_scatter(
        x=x, y=y, name="training episodes", mode="lines", line_width=1, line_color=faded(colour, 0.6)
    )
    x, y = column(metrics, "env_steps", "eval_return_mean")
    if x:
        figure.add_scatter(
            x=x,
            y=y,
            name="evaluation",
            mode="lines+markers",
            line_width=2.5,
            marker_size=7,
            line_color=colour,
        )
    last = max((finite(row.get("env_steps")) or 0.0 for row in metrics), default=0.0)
    # the demonstrations often lie on the expert: dots over a line show both
    dotted = {"color": DEMONSTRATIONS, "dash": "3px,8px", "width": 3}
    for name, value in references.items():
        line = dotted if name == "demonstrations" else {"color": STRATA[name], "width": 1.5}
        label = f"{name} {amount(value)}"
        figure.add_scatter(
            x=[0, last], y=[value, value], name=label, mode="lines", line=line, hoverinfo="skip"
        )
    figure.update_layout(hovermode="x")
    figure.update_traces(hovertemplate="%{y:,.0f}", selector={"hoverinfo": None})
    return framed(figure, STEPS, "return of an episode").update_yaxes(tickformat=",")


def reward_by_stratum(
    snapshots: Sequence[object], strata: Mapping[str, Mapping[str, Sequence[object]]]
) -> go.Figure:
    """Median learned reward of each stratum with its 10 to 90 % band, a point a snapshot."""
    bands, lines = [], []
    for name in STRATA:
        rows = _complete_rows(
            snapshots, *(strata.get(name, {}).get(key, []) for key in ("p10", "median", "p90"))
        )
        if not rows:
            continue
        x, low, middle, high = (list(values) for values in zip(*rows, strict=True))
        fill = {"fill": "toself", "fillcolor": faded(STRATA[name], 0.18), "line_width": 0}
        hidden = {"hoverinfo": "skip", "showlegend": False}
        bands.append(go.Scatter(x=x + x[::-1], y=high + low[::-1], mode="lines", **fill, **hidden))
        label = STRATUM_NAMES[name]
        look = {"line": {"color": STRATA[name], "width": 2}, "marker": {"size": 6}, "mode": "lines+markers"}
        hover = f"{label} %{{y:.3g}}<extra></extra>"
        lines.append(go.Scatter(x=x, y=middle, name=label, **look, hovertemplate=hover))
    # every line above every band
    figure = go.Figure([*bands, *lines]).update_layout(hovermode="x")
    return framed(figure, STEPS, "learned reward of a step")


def learned_against_hand_written(
    learned: Sequence[object], hand_written: Sequence[object], stratum: Sequence[object]
) -> go.Figure:
    """A point a step: the hand-written reward across, the learned one up, coloured by stratum."""
    figure = go.Figure()
    for name in ("random", "policy", "expert"):
        ours = [i for i, group in enumerate(stratum) if group == name]
        points = _complete_rows([hand_written[i] for i in ours], [learned[i] for i in ours])
        if not points:
            continue
        kept = np.array(points[:: _stride(len(points), SCATTER_POINTS)], dtype=np.float32)
        marker = {"size": 5, "color": faded(STRATA[name], 0.45)}
        figure.add_scatter(
            x=kept[:, 0], y=kept[:, 1], name=STRATUM_NAMES[name], mode="markers", marker=marker
        )
    # points overlap and are faint: the legend shows them as large as the eye needs
    figure.update_layout(legend_itemsizing="constant", legend_traceorder="reversed")
    figure.update_traces(hovertemplate="hand-written %{x:.3g}<br>learned %{y:.3g}")
    return framed(figure, "hand-written reward of a step", "learned reward of a step", height=460)


def tiles(
    values: Sequence[Sequence[float | None]],
    said: Sequence[Sequence[object]],
    scale: object,
    hover: str,
    title: str,
) -> go.Figure:
    """A heat map of numbers from 0 to 1; `said` is what `hover` has of each tile."""
    return go.Figure(
        go.Heatmap(
            z=values,
            x=list(range(len(values[0]) if values else 0)),
            y=list(range(len(values))),
            zmin=0,
            zmax=1,
            colorscale=scale,
            xgap=1,
            ygap=1,
            customdata=said,
            hovertemplate=hover,
            colorbar={"title": {"text": title, "side": "right"}, "thickness": 10, "outlinewidth": 0},
        )
    )


def _complete_rows(*columns: Sequence[object]) -> list[tuple[float, ...]]:
    """The rows of which every entry is a finite number."""
    rows = [tuple(finite(value) for value in row) for row in zip(*columns, strict=False)]
    return [tuple(value for value in row if value is not None) for row in rows if None not in row]


def _stride(n: int, most: int) -> int:
    return -(-n // most)


def thinned(x: list[float], y: list[float]) -> tuple[list[float], list[float]]:
    """Every n-th point of a line, where it has more than a screen shows."""
    step = _stride(len(x), LINE_POINTS) or 1
    return x[::step], y[::step]


def short(steps: float) -> str:
    """Steps as a label: 51200 -> 51k."""
    for unit, letter in ((1e6, "M"), (1e3, "k")):
        if steps >= unit:
            return f"{steps / unit:.{0 if steps >= 10 * unit else 1}f}".removesuffix(".0") + letter
    return f"{steps:.0f}"
