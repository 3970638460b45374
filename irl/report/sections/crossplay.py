"""Every policy under every snapshot's reward: does the reward rank policies as the truth does?"""

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from typing import Any

import plotly.graph_objects as go

from irl.report.amounts import amount
from irl.report.folder import RunFiles, finite, lookup, texts
from irl.report.palette import ACCENT, OTHERS, SIGNED, framed
from irl.report.panel import Panel, Table, View, absent, plain, unmeasured
from irl.report.plots import STEPS, short, tiles

MEASURES = ("pearson", "spearman", "kendall", "regret")


def crossplay(run: RunFiles) -> Panel:
    """The matrix, and how well each row's order is the true one."""
    anchor, title = "crossplay", "Cross-play"
    found = lookup(run.evaluation, "cross_play")
    reason = lookup(found, "reason")
    if isinstance(reason, str):
        return absent(anchor, title, reason)
    if not _whole(found):
        return unmeasured(run, anchor, title, "cross_play.learned")
    text = (
        "A row is a snapshot of the reward, a column a policy, from the worst to the best by true return; "
        "blue is the policy that this reward likes least, orange the one it likes best. A reward that ranks "
        "as the truth does goes from blue to orange, left to right; orange on the left is overrated."
    )
    views = (View("matrix", (matrix(found),)), View("agreement over training", (agreement(found),)))
    return Panel(
        anchor,
        title,
        text,
        "crossplay",
        views,
        control_label="cross-play",
        tables=(_table(found),),
        notes=tuple(texts(found.get("notes"))),
    )


def matrix(found: Mapping[str, Any]) -> go.Figure:
    """Ranks of the learned returns within each row, columns by true return."""
    order = sorted(range(len(found["policies"])), key=lambda i: _true(found, i))
    rows = [[row[i] for i in order] for row in found["learned"]]
    names = [f"{plain(found['policies'][i].get('name'))} ({amount(_true(found, i))})" for i in order]
    places = list(range(len(names)))
    up = list(range(len(rows)))
    hover = "%{x}: learned return %{customdata:.4g}, rank %{z:.2f}<extra></extra>"
    drawn = tiles([ranked(row) for row in rows], rows, SIGNED, hover, "rank in its row")
    framed(drawn, "policy (true return)", "reward of snapshot", height=max(330, 22 * len(rows) + 250))
    every = -(-len(up) // 16)
    drawn.update_yaxes(
        tickvals=up[::every],
        ticktext=[short(float(s)) for s in found["snapshots"]][::every],
        showgrid=False,
        autorange="reversed",
    )
    return drawn.update_xaxes(tickvals=places, ticktext=names, tickangle=-55, tickfont_size=11)


def agreement(found: Mapping[str, Any]) -> go.Figure:
    """Rank agreement with the truth and regret, over training."""
    drawn = go.Figure()
    rows = [row for row in found.get("agreement") or () if isinstance(row, Mapping)]
    looks = {
        "spearman": (OTHERS[0], "solid"),
        "kendall": (OTHERS[2], "dash"),
        "pearson": (ACCENT, "dot"),
        "regret": (OTHERS[1], "dashdot"),
    }
    for name, (colour, dash) in looks.items():
        points = [(finite(row.get("step")), _value(row, name)) for row in rows]
        known = [(x, y) for x, y in points if x is not None and y is not None]
        drawn.add_scatter(
            x=[x for x, _ in known],
            y=[y for _, y in known],
            name=name,
            mode="lines+markers",
            marker_size=6,
            line={"color": colour, "dash": dash, "width": 2},
            hovertemplate=f"{name} %{{y:.2f}}<extra></extra>",
        )
    framed(drawn, STEPS, "agreement (1 the same); regret (0 none)", height=380)
    return drawn.update_layout(hovermode="x")


def ranked(row: Sequence[float | None]) -> list[float | None]:
    """The place of each number in its row, 0 the least and 1 the most; equal ones share theirs."""
    known = sorted(value for value in row if value is not None)
    most = max(1, len(known) - 1)

    def place(value: float) -> float:
        return (bisect_left(known, value) + bisect_right(known, value) - 1) / 2 / most

    return [None if value is None else place(value) for value in row]


def _table(found: Mapping[str, Any]) -> Table:
    rows = [row for row in found.get("agreement") or () if isinstance(row, Mapping)][-1:]
    shown = [
        (name, _value(row, name), *(finite(lookup(row, f"{name}.{end}")) for end in ("low", "high")))
        for row in rows
        for name in MEASURES
    ]
    return Table(
        ("last snapshot", "value", "95 % low", "high"), shown, "Agreement with the true order of the policies"
    )


def _value(row: Mapping[str, Any], name: str) -> float | None:
    return (
        finite(lookup(row, f"{name}.value")) if isinstance(row.get(name), Mapping) else finite(row.get(name))
    )


def _true(found: Mapping[str, Any], i: int) -> float:
    return finite(lookup(found["policies"][i], "true_return")) or 0.0


def _whole(found: object) -> bool:
    if not isinstance(found, Mapping):
        return False
    steps, policies, learned = (found.get(key) for key in ("snapshots", "policies", "learned"))
    if not all(isinstance(part, list) and part for part in (steps, policies, learned)):
        return False
    assert isinstance(steps, list)
    assert isinstance(policies, list)
    assert isinstance(learned, list)
    return (
        len(learned) == len(steps)
        and isinstance(found.get("agreement") or [], list)
        and all(finite(step) is not None for step in steps)
        and all(isinstance(policy, Mapping) for policy in policies)
        and all(isinstance(row, list) and len(row) == len(policies) for row in learned)
        and all(v is None or finite(v) is not None for row in learned for v in row)
    )
