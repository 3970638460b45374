"""Several runs on one axis: methods as colours, seeds as thin lines, their interquartile mean thick."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from irl.core.rng import stream
from irl.core.statistics import FEW, iqm, iqm_interval
from irl.report.folder import RunFiles, column, finite, lookup, number
from irl.report.grouping import labels
from irl.report.palette import INK, METHODS, OTHERS, faded, framed
from irl.report.panel import Cell, Panel, Table, View, absent, plain
from irl.report.plots import STEPS, thinned

POINTS = 120
"""Steps at which a mean over seeds is taken."""
Curve = tuple[list[float], list[float]]


def compare(runs: Sequence[RunFiles]) -> Panel:
    """Overlays, a table a run and a table a method."""
    anchor, title = "compare", f"{len(runs)} runs beside each other"
    views = []
    for label, unit, curve in _CURVES:
        lines = [(run, curve(run)) for run in runs]
        if any(points for _, (_, points) in lines):
            views.append(View(label, (overlay(lines, unit),)))
    text = (
        "A colour is a method on a task with one set of settings, a thin line a run of one seed, a thick "
        "line the interquartile mean of its seeds. Runs agree where the thin lines of a colour lie together; "
        "a method is better than another only where its whole bundle is."
    )
    tables = (_table(runs), _by_method(runs))
    if not views and not any(run.evaluation for run in runs):
        return absent(anchor, title, "none of the runs has a curve or an evaluation", "irl evaluate RUN")
    return Panel(
        anchor, title, text, "compare", tuple(views), control_label="what is compared", tables=tables
    )


def overlay(lines: Sequence[tuple[RunFiles, Curve]], unit: str) -> go.Figure:
    """Thin lines of all runs, and a thick one of each method that has several."""
    of = labels([run for run, _ in lines])
    drawn, colours = go.Figure(), colours_of([*of.values()])
    for run, (x, y) in lines:
        method = of[id(run)]
        if y:
            drawn.add_scatter(
                x=x,
                y=y,
                mode="lines",
                name=plain(method),
                legendgroup=plain(method),
                showlegend=False,
                line={"color": faded(colours[method], 0.6), "width": 1.2},
                hovertemplate=f"{plain(run.name)} %{{y:.3g}}<extra></extra>",
            )
    for method, colour in colours.items():
        mine = [curve for run, curve in lines if of[id(run)] == method and curve[1]]
        if not mine:
            continue
        x, y = mean_of(mine)
        name = f"{plain(method)} ({len(mine)} run{'s' * (len(mine) != 1)})"
        drawn.add_scatter(
            x=x,
            y=y,
            mode="lines",
            name=name,
            legendgroup=plain(method),
            line={"color": colour, "width": 3},
            hovertemplate=f"{name} %{{y:.3g}}<extra></extra>",
        )
    framed(drawn, STEPS, unit, height=430)
    return drawn.update_layout(hovermode="x")


def mean_of(curves: Sequence[Curve]) -> Curve:
    """The interquartile mean where all of the curves are."""
    start, end = max(x[0] for x, _ in curves), min(x[-1] for x, _ in curves)
    if not end > start:
        return curves[0] if len(curves) == 1 else ([], [])
    at = np.linspace(start, end, POINTS)
    levels = np.stack([np.interp(at, x, y) for x, y in curves], axis=-1)
    return at.tolist(), [iqm(row) for row in levels]


def colours_of(methods: Sequence[str]) -> dict[str, str]:
    """A colour a method; of its own where it is known, and apart where several tasks share one."""
    found: dict[str, str] = {}
    for method in dict.fromkeys(methods):
        own = METHODS.get(method.split(",")[0])
        free = [colour for colour in OTHERS if colour not in found.values()]
        found[method] = own if own and own not in found.values() else free[0] if free else INK
    return found


def _by_snapshot(path: str) -> Callable[[RunFiles], Curve]:
    def curve(run: RunFiles) -> Curve:
        at, rows = (
            lookup(run.evaluation, "drift.snapshots"),
            lookup(run.evaluation, f"drift.{path.partition('.')[0]}"),
        )
        if not isinstance(at, list) or not isinstance(rows, list):
            return [], []
        key = path.partition(".")[2]
        points = [{"at": step, "value": lookup(row, key)} for step, row in zip(at, rows, strict=False)]
        return column(points, "at", "value")

    return curve


def _returns(key: str) -> Callable[[RunFiles], Curve]:
    return lambda run: thinned(*column(run.metrics, "env_steps", key))


_CURVES: tuple[tuple[str, str, Callable[[RunFiles], Curve]], ...] = (
    ("return in training", "return of an episode (return_mean)", _returns("return_mean")),
    ("return evaluated", "return of an episode (eval_return_mean)", _returns("eval_return_mean")),
    ("distance to the hand-written reward", "VAL distance, 0 the same", _by_snapshot("to_truth.value")),
    ("discriminator", "AUROC, held-out expert against policy", _by_snapshot("health.held_out.auroc")),
)

_MEASURES: Mapping[str, str] = {
    "score": "policy.normalised_score",
    "return": "policy.return_mean",
    "± std": "policy.return_std",
    "distance (VAL)": "distances.headline.value",
    "95 % low": "distances.headline.low",
    "high": "distances.headline.high",
    "own error": "distances.headline.self_error",
    "explained by terms": "terms.explained",
}


def _table(runs: Sequence[RunFiles]) -> Table:
    of = labels(runs)
    rows: list[tuple[Cell, ...]] = [
        (
            run.name,
            of[id(run)],
            str(run.config.get("seed", "?")),
            *(number(run.evaluation, p) for p in _MEASURES.values()),
        )
        for run in runs
    ]
    return Table(
        ("run", "method", "seed", *_MEASURES),
        rows,
        "Every run; the interval of the distance is over episodes",
    )


def _by_method(runs: Sequence[RunFiles]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    of = labels(runs)
    for method in dict.fromkeys(of.values()):
        mine = [run for run in runs if of[id(run)] == method]
        for name, path in (
            ("score", "policy.normalised_score"),
            ("distance (VAL)", "distances.headline.value"),
        ):
            values = [v for run in mine if (v := finite(lookup(run.evaluation, path))) is not None]
            ends = iqm_interval(np.array(values), stream(0, "seeds"))
            middle, low, high = (finite(v) for v in (iqm(np.array(values)), *ends))
            rows.append((method, name, float(len(values)), middle, low, high))
    head = ("method", "measured", "runs", "interquartile mean", "95 % low", "high")
    few = any(isinstance(row[2], float) and row[2] < FEW for row in rows)
    doubt = f", and says little with fewer than {FEW} of them" if few else ""
    return Table(head, rows, f"Every method; the interval is over runs{doubt}")
