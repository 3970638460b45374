"""Proxy against gold: what the learned reward thinks of the policies, and what they are worth."""

from collections.abc import Mapping, Sequence

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from irl.report.folder import RunFiles, finite, lookup, number
from irl.report.palette import ACCENT, INK, STRATA, framed
from irl.report.panel import Panel, Table, one, unmeasured
from irl.report.plots import STEPS

Points = Sequence[tuple[float, float, float]]


def gold(run: RunFiles) -> Panel:
    """Two curves over the same steps."""
    anchor, title = "gold", "Proxy against gold"
    rows = lookup(run.evaluation, "proxy_gold.points")
    read = (
        [tuple(finite(lookup(row, key)) for key in ("step", "proxy", "gold")) for row in rows]
        if isinstance(rows, list)
        else []
    )
    points = [(a, b, c) for a, b, c in read if a is not None and b is not None and c is not None]
    if not points:
        return unmeasured(run, anchor, title, "proxy_gold.points")
    peak = number(run.evaluation, "proxy_gold.peak_step")
    text = (
        "Above, what the last learned reward pays each snapshot's policy (the proxy); below, what the task "
        "pays it (gold). Both rising together is what a reward is for; a proxy that rises while gold falls "
        "is a reward that is being hacked."
    )
    return Panel(
        anchor, title, text, "gold", one(figure(points, peak)), tables=(_table(run),), notes=_notes(run)
    )


def figure(points: Points, peak: float | None) -> go.Figure:
    """The proxy above the gold return, with the peak marked."""
    drawn = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.06)
    steps = [row[0] for row in points]
    for i, (name, colour) in enumerate(
        (("proxy: learned return", ACCENT), ("gold: true return", STRATA["policy"])), 1
    ):
        drawn.add_scatter(
            x=steps,
            y=[row[i] for row in points],
            name=name,
            mode="lines+markers",
            marker_size=6,
            line={"color": colour, "width": 2},
            hovertemplate="%{y:,.4g}",
            row=i,
            col=1,
        )
    framed(drawn, "", "", height=440)
    if peak is not None:
        drawn.add_vline(x=peak, line={"color": INK, "width": 1, "dash": "dash"}, row="all", col=1)  # pyright: ignore[reportArgumentType]
    drawn.update_xaxes(
        title_text=f"{STEPS}; dashed: gold's peak" if peak is not None else STEPS, row=2, col=1
    )
    drawn.update_yaxes(title_text="learned return", row=1, col=1)
    drawn.update_yaxes(title_text="true return", row=2, col=1)
    return drawn.update_layout(hovermode="x")


def _table(run: RunFiles) -> Table:
    meanings = {
        "peak_step": "step at which gold is highest",
        "drop": "share of the gain in gold that was lost again by the end",
        "gap": "proxy less gold at the end, in standard deviations",
        "decoupling_step": "step at which the first stretch begins in which the two do not rise together",
    }
    rows = [(words, number(run.evaluation, f"proxy_gold.{key}")) for key, words in meanings.items()]
    return Table(("measured", "value"), rows, "Over-optimisation")


def _notes(run: RunFiles) -> tuple[str, ...]:
    fit, why = lookup(run.evaluation, "proxy_gold.fit"), lookup(run.evaluation, "proxy_gold.fit_reason")
    if isinstance(fit, Mapping):
        alpha, beta = number(fit, "alpha"), number(fit, "beta")
        if alpha is not None and beta is not None:
            return (f"Fitted: {fit.get('form')}, with alpha {alpha:.3g} and beta {beta:.3g}.",)
    return (f"No curve is fitted: {why}.",) if isinstance(why, str) else ()
