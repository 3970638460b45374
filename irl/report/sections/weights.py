"""What the learned reward pays for, in terms of the hand-written one, over training."""

from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from irl.report.folder import RunFiles, finite, lookup, number
from irl.report.palette import OTHERS, faded, framed
from irl.report.panel import Panel, Table, one, plain, unmeasured
from irl.report.plots import STEPS

SHAPING, UNEXPLAINED = "shaping", "unexplained"
REMAINDERS = {SHAPING: "#d8b441", UNEXPLAINED: "#7d8590"}


def weights(run: RunFiles) -> Panel:
    """Standardised weights with intervals, shares with shaping and what is left over, and the flags."""
    anchor, title = "terms", "Terms"
    known = lookup(run.evaluation, "terms.weights")
    if not isinstance(known, Mapping) or not known:
        return unmeasured(run, anchor, title, "terms.weights")
    text = (
        "Above, what one deviation of each term moves the learned reward by, with 95 % intervals; below, the "
        "share of its variance that each term, a potential's shaping and none of them account "
        "for. A faithful "
        "reward pays the terms in the proportions of the hand-written one and leaves little unexplained. A "
        "weight marked as not identifiable is no evidence either way."
    )
    over = lookup(run.evaluation, "drift.pictures.terms")
    views = ()
    if isinstance(over, Mapping) and isinstance(steps := over.get("snapshots"), list) and _whole(over, steps):
        views = one(figure(over, [float(step) for step in steps]))
    tables = tuple(table for table in (_table(run, known), _residual(run)) if table is not None)
    return Panel(anchor, title, text, "terms", views, tables=tables, notes=_notes(run))


def figure(over: Mapping[str, Any], steps: Sequence[float]) -> go.Figure:
    """Two rows over the same steps."""
    drawn = make_subplots(rows=2, cols=1, shared_xaxes=True, row_heights=[0.5, 0.5], vertical_spacing=0.06)
    rest = [max(0.0, 1.0 - (value or 0.0)) for value in over["explained"]]
    shares: dict[str, list[float]] = {}
    for i, (name, row) in enumerate(over["weights"].items()):
        colour = OTHERS[i % len(OTHERS)] if i < len(OTHERS) - 2 else OTHERS[-1]
        _draw_weight(drawn, str(name), colour, row, over, steps)
        shares[str(name)] = [max(0.0, value or 0.0) for value in row["share"]]
    shares |= {SHAPING: [max(0.0, value or 0.0) for value in over["shaping"]], UNEXPLAINED: rest}
    for i, (name, values) in enumerate(shares.items()):
        colour = REMAINDERS.get(name, OTHERS[i % len(OTHERS)])
        drawn.add_scatter(
            x=list(steps),
            y=[100 * v for v in values],
            name=plain(name),
            legendgroup=plain(name),
            stackgroup="share",
            line={"width": 0.5, "color": colour},
            fillcolor=faded(colour, 0.3 if name == UNEXPLAINED else 0.75),
            showlegend=name in REMAINDERS,
            hovertemplate=f"{plain(name)} %{{y:.0f}} %<extra></extra>",
            row=2,
            col=1,
        )
    framed(drawn, "", "", height=560)
    drawn.update_xaxes(title_text=STEPS, row=2, col=1)
    drawn.update_yaxes(title_text="standardised weight", zeroline=True, zerolinecolor="#808080", row=1, col=1)
    drawn.update_yaxes(title_text="share of variance (%)", range=[0, 100], row=2, col=1)
    return drawn.update_layout(hovermode="x", legend_traceorder="normal")


def _draw_weight(
    drawn: go.Figure,
    name: str,
    colour: str,
    row: Mapping[str, Any],
    over: Mapping[str, Any],
    steps: Sequence[float],
) -> None:
    spread, scale = finite(over["std"].get(name)), over["reward_std"]
    unknown = isinstance(row.get("why_not"), str)

    def scaled(key: str) -> list[float | None]:
        return [
            None if (v := finite(value)) is None or spread is None or not finite(s) else v * spread / s
            for value, s in zip(row[key], scale, strict=True)
        ]

    middle, low, high = scaled("weight"), scaled("low"), scaled("high")
    gaps = {"array": _less(high, middle), "arrayminus": _less(middle, low), "thickness": 1.2, "width": 3}
    drawn.add_scatter(
        x=list(steps),
        y=middle,
        mode="lines+markers",
        marker_size=6,
        legendgroup=plain(name),
        marker_symbol="circle-open" if unknown else "circle",
        name=plain(name) + (" (not identifiable)" if unknown else ""),
        error_y={"type": "data", "symmetric": False, **gaps},
        line={"color": colour, "width": 2, "dash": "dot" if unknown else "solid"},
        hovertemplate=f"{plain(name)} %{{y:.2f}}<extra></extra>",
        row=1,
        col=1,
    )


def _less(a: list[float | None], b: list[float | None]) -> list[float | None]:
    return [None if x is None or y is None else max(0.0, x - y) for x, y in zip(a, b, strict=True)]


def _whole(over: Mapping[str, Any], steps: object) -> bool:
    if not isinstance(steps, list) or not steps or not isinstance(over.get("std"), Mapping):
        return False
    rows = over.get("weights")
    columns = [over.get(key) for key in ("explained", "shaping", "reward_std")]
    if not isinstance(rows, Mapping):
        return False
    columns += [lookup(row, key) for row in rows.values() for key in ("weight", "low", "high", "share")]
    return all(finite(step) is not None for step in steps) and all(
        isinstance(c, list) and len(c) == len(steps) and all(v is None or finite(v) is not None for v in c)
        for c in columns
    )


def _table(run: RunFiles, known: Mapping[str, Any]) -> Table:
    keys = ("weight", "low", "high", "standardised", "share")
    rows: list[tuple[str | float | None, ...]] = []
    for name, row in known.items():
        why_not = lookup(row, "why_not")
        flag = f"not identifiable: {why_not}" if isinstance(why_not, str) else "identifiable"
        rows.append((str(name), *(number(row, key) for key in keys), flag))
    for name, key in (("a potential's shaping", "shaping"), ("terms and shaping together", "explained")):
        rows.append((name, "", "", "", "", number(run.evaluation, f"terms.{key}"), ""))
    head = ("term", "weight", "95 % low", "high", "standardised", "share", "can it be known?")
    return Table(head, rows, "The last snapshot's terms")


def _notes(run: RunFiles) -> tuple[str, ...]:
    bonus, r2 = number(run.evaluation, "terms.survival_bonus"), number(run.evaluation, "residual.r2")
    notes = (
        "Weight: in the learned reward's units for one of the term's; standardised: what one deviation of "
        "the term moves the learned reward by, in deviations of its own; share: of its variance.",
    )
    if bonus is not None:
        notes += (
            f"Survival bonus: not ending the episode pays {bonus:+.3g} a step, with the discounted offset.",
        )
    if r2 is not None and r2 <= 0:
        notes += ("What the unexplained part depends on was not found: a nonlinear fit explains none of it.",)
    return notes


def _residual(run: RunFiles) -> Table | None:
    """What else it pays for: what random waves and a ridge find in the part that no term explains."""
    features, r2 = lookup(run.evaluation, "residual.features"), number(run.evaluation, "residual.r2")
    # a fit that does worse than the mean has found nothing, and its importances mean nothing
    if not isinstance(features, list) or (r2 is not None and r2 <= 0):
        return None
    rows = [
        (str(lookup(row, "name")), number(row, "importance"))
        for row in features[:8]
        if isinstance(row, Mapping)
    ]
    said = "" if r2 is None else f" (a nonlinear fit explains {100 * r2:.0f} % of it)"
    return (
        Table(("input", "importance"), rows, f"What the unexplained part depends on{said}") if rows else None
    )
