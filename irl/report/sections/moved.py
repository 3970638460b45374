"""What moved in the reward between snapshots, above the discriminator's health, on one axis of steps."""

from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from irl.report.folder import RunFiles, column, finite, lookup
from irl.report.palette import ACCENT, CHANGES, INK, STRATA, faded, framed
from irl.report.panel import Panel, View, absent
from irl.report.plots import STEPS, thinned

ACCURACY = {"expert": "discriminator/accuracy_expert", "policy": "discriminator/accuracy_policy"}


def moved(run: RunFiles) -> Panel:
    """Total change, its shares, and whether expert and policy can be told apart."""
    anchor, title = "moved", "What moved"
    snapshots, changes = _changes(run)
    health = _health(run)
    if not changes and not any(points for _, points in health.values()):
        reason = "the run has no snapshots that were compared, and no discriminator in metrics.jsonl"
        return absent(anchor, title, reason, f"irl evaluate {run.name}")
    text = (
        "Above, how far the reward moved since the snapshot before; in the middle, how much of it was "
        "offset, scale or shape, of which only shape asks for other steps (an offset too, where "
        "episodes can end "
        "early); below, the discriminator: at 50 % it cannot tell the policy from the expert and its reward "
        "has nothing left to say, near 100 % it tells everything apart and the reward is steep."
    )
    if not changes:
        below = text.rpartition("; below, ")[2]
        text = f"What moved is not measured yet (irl evaluate {run.name}). Below, {below}"
    views = [View("steps", (figure(snapshots, changes, health, "linear"),))]
    if len(changes) > 3:
        views.append(View("steps, logarithmic", (figure(snapshots, changes, health, "log"),)))
    return Panel(anchor, title, text, "moved", tuple(views))


Health = Mapping[str, tuple[list[float], list[float]]]


def figure(
    snapshots: Sequence[float], changes: Sequence[Mapping[str, Any]], health: Health, axis: str
) -> go.Figure:
    """Three rows over one axis of environment steps."""
    drawn = make_subplots(
        rows=3, cols=1, shared_xaxes=True, row_heights=[0.24, 0.36, 0.4], vertical_spacing=0.05
    )
    _draw_changes(drawn, snapshots, changes)
    _draw_health(drawn, health)
    framed(drawn, "", "", height=620)
    drawn.add_hline(y=50, line={"color": INK, "width": 1, "dash": "dash"}, row=3, col=1)  # pyright: ignore[reportArgumentType]
    drawn.update_xaxes(type=axis)
    drawn.update_xaxes(title_text=STEPS, row=3, col=1)
    drawn.update_yaxes(title_text="change (reward)", nticks=4, rangemode="tozero", row=1, col=1)
    drawn.update_yaxes(title_text="share (%)", range=[0, 100], row=2, col=1)
    drawn.update_yaxes(title_text="told apart (%)", range=[0, 103], row=3, col=1)
    drawn.update_layout(hovermode="x", legend_traceorder="normal")
    return drawn


def _draw_changes(drawn: go.Figure, snapshots: Sequence[float], changes: Sequence[Mapping[str, Any]]) -> None:
    if not changes:
        return
    ends = [float(at) for at in snapshots[1:]]
    size = [float(row["total"]) ** 0.5 for row in changes]
    drawn.add_scatter(
        x=ends,
        y=size,
        mode="lines+markers",
        line_color=INK,
        marker_size=6,
        name="change since the snapshot before",
        hovertemplate="%{y:.3g}",
        row=1,
        col=1,
    )
    for name, colour in CHANGES.items():
        share = [
            100 * float(row[name]) / float(row["total"]) if float(row["total"]) > 0 else None
            for row in changes
        ]
        drawn.add_scatter(
            # from the snapshot before to this one, so the first share begins where training does
            x=[float(snapshots[0]), *ends],
            y=[share[0], *share],
            name=name,
            stackgroup="share",
            line={"width": 0.5, "color": colour, "shape": "vh"},
            fillcolor=faded(colour, 0.75),
            hovertemplate=f"{name} %{{y:.0f}} %<extra></extra>",
            row=2,
            col=1,
        )


def _draw_health(drawn: go.Figure, health: Health) -> None:
    looks = {
        "accuracy on expert steps": (STRATA["expert"], "solid", 1.2, "lines"),
        "accuracy on policy steps": (STRATA["policy"], "solid", 1.2, "lines"),
        "AUROC, held-out expert": (ACCENT, "solid", 2, "lines+markers"),
        "AUROC, training demonstrations": (ACCENT, "dot", 2, "lines+markers"),
    }
    for name, (colour, dash, width, mode) in looks.items():
        x, y = health[name]
        if x:
            drawn.add_scatter(
                x=x,
                y=[100 * v for v in y],
                name=name,
                mode=mode,
                hovertemplate="%{y:.1f} %",
                line={"color": colour, "dash": dash, "width": width},
                marker_size=6,
                row=3,
                col=1,
            )


def _changes(run: RunFiles) -> tuple[list[float], list[Mapping[str, Any]]]:
    """The steps of the snapshots, and the split of each change between two."""
    snapshots = lookup(run.evaluation, "drift.snapshots")
    for path in ("drift.moves", "drift.changes"):
        rows = lookup(run.evaluation, path)
        whole = isinstance(rows, list) and all(
            finite(lookup(row, key)) is not None for row in rows for key in ("total", *CHANGES)
        )
        at = [finite(step) for step in snapshots] if isinstance(snapshots, list) else []
        if rows and whole and None not in at and len(at) == len(rows) + 1:
            return [step for step in at if step is not None], rows
    return [], []


def _health(run: RunFiles) -> Health:
    found = {
        f"accuracy on {who} steps": thinned(*column(run.metrics, "env_steps", key))
        for who, key in ACCURACY.items()
    }
    at, rows = lookup(run.evaluation, "drift.snapshots"), lookup(run.evaluation, "drift.health")
    steps = at if isinstance(at, list) and isinstance(rows, list) else []
    for name, side in (("held-out expert", "held_out"), ("training demonstrations", "train")):
        points = [
            {"at": step, "auroc": lookup(row, f"{side}.auroc")}
            for step, row in zip(steps, rows or (), strict=False)
        ]
        found[f"AUROC, {name}"] = column(points, "at", "auroc")
    return found
