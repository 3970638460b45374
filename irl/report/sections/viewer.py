"""The episode viewer: pictures, and every reward of every step, under one cursor."""

import base64
import re
from collections.abc import Mapping, Sequence
from html import escape
from itertools import accumulate
from pathlib import Path
from typing import Any

import plotly.graph_objects as go

from irl.report.amounts import amount
from irl.report.folder import RunFiles, finite, lookup
from irl.report.markup import drawing, embedded
from irl.report.palette import ACCENT, AXIS, INK, LAYOUT, OTHERS
from irl.report.panel import Panel, View, plain, unmeasured

MOST_BYTES = 1_000_000
"""Of the pictures of one episode, as they go into the page."""
ROW = 84
"""Height of one trace in pixels."""


def viewer(run: RunFiles, pictures: bool = True) -> Panel:
    """A tab an episode."""
    anchor, title = "episodes", "Episode viewer"
    found = lookup(run.evaluation, "episodes")
    whole = [row for row in found if _whole(row)] if isinstance(found, list) else []
    if not whole:
        return unmeasured(run, anchor, title, "episodes")
    text = (
        "Drag the cursor, or use the arrow keys on it, or click into a trace: picture and numbers follow. A "
        "good reward dips where the play is bad by the hand-written one too; look for the moments at which "
        "the two part, and at the fall if there is one."
    )
    shown = [_episode(run.path, row, f"{run.name}-{i}", pictures) for i, row in enumerate(whole)]
    views = tuple(View(_label(row), html=html) for row, html in zip(whole, shown, strict=True))
    return Panel(anchor, title, text, "episodes", views, control_label="episode")


def traces(row: Mapping[str, Any]) -> dict[str, list[float | None]]:
    """Rewards of every step by name: learned, hand-written, then its terms."""
    terms = row.get("terms")
    named = {str(name): values for name, values in terms.items()} if isinstance(terms, Mapping) else {}
    return {"learned": row["learned"], "hand-written": row["hand_written"], **named}


def figure(series: Mapping[str, Sequence[float | None]], dt: float | None) -> go.Figure:
    """A row a trace, each with its own scale, over one axis of steps."""
    colours, n = [ACCENT, INK, *OTHERS], len(series)
    traces, axes = [], {}
    for i, (name, values) in enumerate(series.items()):
        number = "" if i == 0 else str(i + 1)
        title = {"text": plain(name), "font": {"size": 11}, "standoff": 4}
        # the first trace on top
        domain = [1 - (i + 0.86) / n, 1 - i / n]
        axes[f"yaxis{number}"] = {**AXIS, "title": title, "nticks": 3, "domain": domain}
        line = {"color": colours[i % len(colours)], "width": 1.6}
        look = {"mode": "lines", "name": plain(name), "line": line, "hovertemplate": "%{y:.4g}"}
        traces.append(
            {
                "type": "scatter",
                "x": list(range(len(values))),
                "y": list(values),
                "yaxis": f"y{number}",
                **look,
            }
        )
    seconds = "" if dt is None else f" ({dt:.3g} s)"
    bottom = {
        "title": {"text": f"step{seconds}", "font": {"size": 13}},
        "anchor": "y" if n == 1 else f"y{n}",
        "showline": True,
        "showgrid": False,
    }
    # written at once: a call an axis would take most of the page's time
    layout = {
        "xaxis": {**AXIS, **bottom},
        **axes,
        "showlegend": False,
        "hovermode": "x",
        "meta": {"cursor": True},
    }
    return go.Figure({"data": traces, "layout": {**LAYOUT, **layout, "height": ROW * n + 60}})


def _episode(run: Path, row: Mapping[str, Any], name: str, pictures: bool) -> str:
    series, dt = traces(row), finite(row.get("dt_s"))
    sums = {key: list(accumulate(v or 0.0 for v in values)) for key, values in series.items()}
    steps = len(series["learned"])
    picture, why = _film(run, row) if pictures else (None, "left out to keep the page small")
    screen = (
        f'<canvas width="{picture["width"]}" height="{picture["height"]}" role="img" '
        'aria-label="picture of the step"></canvas>'
        if picture
        else f'<p class="absent">No pictures: {escape(why.rstrip("."))}.</p>'
    )
    file = re.sub(r"[^A-Za-z0-9._-]", "-", name)
    drawn = "".join(
        drawing(figure(values, dt), f"{file}-{kind}", what)
        for values, what, kind in ((series, "Reward of each step", "steps"), (sums, "Sum so far", "sums"))
    )
    data = {"film": picture, "dt": dt, "series": series, "sums": sums}
    return (
        f'<div class="episode"><script type="application/json" class="episode-data">{embedded(data)}</script>'
        f'<div class="screen">{screen}<div class="cursor"><button type="button" class="play">Play</button>'
        f'<label>step <output>0</output><input type="range" min="0" max="{steps - 1}" value="0" '
        f'aria-label="step of the episode"></label></div><table class="readout"><thead><tr><th>reward</th>'
        f"<th>this step</th><th>sum so far</th></tr></thead><tbody></tbody></table></div>{drawn}</div>"
    )


def _film(run: Path, row: Mapping[str, Any]) -> tuple[dict[str, Any] | None, str]:
    """The pictures as the page needs them, or why there are none."""
    film = row.get("film")
    if not isinstance(film, Mapping):
        return None, str(row.get("film_reason") or "none were recorded")
    keys = ("every", "frames", "across", "width", "height")
    sizes = {key: film.get(key) for key in keys}
    name = str(film.get("file"))
    if not re.fullmatch(r"episodes/[a-z]+\.webp", name) or not all(
        isinstance(v, int) and not isinstance(v, bool) and 0 < v <= 4096 for v in sizes.values()
    ):
        return None, "evaluation.json does not say what they are"
    try:
        with (run / name).open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        return None, f"{name}: {error.strerror}"
    if len(content) > MOST_BYTES or content[:4] != b"RIFF" or content[8:12] != b"WEBP":
        return None, f"{name} is no WebP picture of at most {MOST_BYTES:,} bytes"
    return {**sizes, "src": "data:image/webp;base64," + base64.b64encode(content).decode()}, ""


def _label(row: Mapping[str, Any]) -> str:
    total, steps = finite(row.get("return")), len(row["learned"])
    end = "fell" if row.get("terminated") is True else "ran to the end"
    return (
        f"{row.get('name')}: return {'not known' if total is None else amount(total)}, {steps:,} steps, {end}"
    )


def _whole(row: object) -> bool:
    if not isinstance(row, Mapping):
        return False
    learned, terms = row.get("learned"), row.get("terms")
    columns = [learned, row.get("hand_written"), *(terms.values() if isinstance(terms, Mapping) else ())]
    return bool(learned) and all(
        isinstance(c, list) and len(c) == len(learned) and all(v is None or finite(v) is not None for v in c)
        for c in columns
    )
