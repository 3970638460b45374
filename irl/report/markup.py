"""Panels as HTML. Every string is escaped here, but for a panel's own `html`."""

import json
import math
from collections.abc import Iterator
from html import escape
from itertools import count
from typing import Any

import plotly.graph_objects as go

from irl.report.panel import Cell, Panel, Table

DIGITS = 6
"""Significant digits of a number in a figure."""


class Page:
    """Numbers the figures and tables of one page."""

    def __init__(self) -> None:
        self._ids: Iterator[int] = count(1)

    def section(self, panel: Panel, prefix: str = "") -> str:
        """The section of a panel; `prefix` keeps the anchors of several runs apart."""
        anchor = f"{prefix}{panel.anchor}"
        if panel.missing:
            content = f'<p class="absent">{_code(panel.text)}</p>'
        else:
            content = self._content(panel, prefix)
        missing = ' class="missing"' if panel.missing else ""
        return (
            f'<section id="{anchor}" data-section="{panel.anchor}"{missing} aria-labelledby="{anchor}-title">'
            f'<h2 id="{anchor}-title">{escape(panel.title)}</h2>{content}</section>'
        )

    def _content(self, panel: Panel, prefix: str) -> str:
        how = f' <a class="how" href="#how-{panel.how}">How it is calculated</a>' if panel.how else ""
        reading = f'<p class="reading">{escape(panel.text)}{how}</p>' if panel.text or how else ""
        data = "".join(
            f'<script type="application/json" data-name="{name}">{embedded(value)}</script>'
            for name, value in panel.data.items()
        )
        tables = "".join(self.table(table, f"{prefix}{panel.anchor}") for table in panel.tables)
        notes = "".join(f'<p class="soft">{escape(note)}</p>' for note in panel.notes)
        # a string of a file has no bare quote here, so this is a link of ours
        own = panel.html.replace('href="#', f'href="#{prefix}')
        return reading + self._views(panel, prefix) + own + data + tables + notes

    def _views(self, panel: Panel, prefix: str) -> str:
        name = f"{prefix}{panel.anchor}"
        shown = [
            "".join(drawing(figure, f"{name}-{i}-{j}") for j, figure in enumerate(view.figures)) + view.html
            for i, view in enumerate(panel.views)
        ]
        if len(shown) < 2:
            return "".join(f'<div class="view">{figures}</div>' for figures in shown)
        labels = [view.label for view in panel.views]
        return controlled(name, labels, shown, panel.control, panel.control_label, panel.chosen)

    def table(self, table: Table, name: str) -> str:
        """A table that can be taken as CSV or JSON, and scrolls sideways where it must."""
        head = "".join(f'<th scope="col">{escape(column)}</th>' for column in table.columns)
        rows = "".join(
            f'<tr><th scope="row">{_shown(row[0])}</th>{"".join(map(_cell, row[1:]))}</tr>'
            for row in table.rows
        )
        tag = "summary" if table.folded else "p"
        caption = f'<{tag} class="caption">{escape(table.caption)}</{tag}>' if table.caption else ""
        block = "details" if table.folded else "div"
        said = escape(table.caption or "table")
        return (
            f'<{block} class="tabled" data-file="{name}-table-{next(self._ids)}">{caption}'
            f'<div class="wide" tabindex="0" role="region" aria-label="{said}"><table aria-label="{said}">'
            f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>{_take(name)}</{block}>"
        )


def controlled(
    name: str, labels: list[str], views: list[str], control: str, label: str = "", chosen: int = 0
) -> str:
    """Views of which one is shown: tabs, or a slider over them."""
    bodies = "".join(
        f'<div class="view" id="{name}-view-{i}" {_role(control, name, i)}'
        f"{'' if i == chosen else ' hidden'}>{body}</div>"
        for i, body in enumerate(views)
    )
    if control == "slider":
        texts = escape(json.dumps(labels), quote=True)
        head = (
            f'<label class="slider"><span>{escape(label)} <output>{escape(labels[chosen])}</output></span>'
            f'<input type="range" min="0" max="{len(labels) - 1}" value="{chosen}" data-labels="{texts}" '
            f'aria-valuetext="{escape(labels[chosen])}"></label>'
        )
    else:
        tabs = "".join(
            f'<button type="button" role="tab" id="{name}-tab-{i}" aria-controls="{name}-view-{i}" '
            f'aria-selected="{"true" if i == chosen else "false"}" tabindex="{0 if i == chosen else -1}">'
            f"{escape(text)}</button>"
            for i, text in enumerate(labels)
        )
        head = f'<div role="tablist" aria-label="{escape(label or "views")}">{tabs}</div>'
    return f'<div class="views">{head}{bodies}</div>'


def _role(control: str, name: str, i: int) -> str:
    return "" if control == "slider" else f'role="tabpanel" aria-labelledby="{name}-tab-{i}"'


def drawing(figure: go.Figure, name: str, title: str = "") -> str:
    """A figure that a script draws when it comes into sight, with its numbers beside it."""
    height = figure.layout.height or 380  # pyright: ignore[reportAttributeAccessIssue]
    caption = f"<figcaption>{escape(title)}</figcaption>" if title else ""
    return (
        f'<figure class="plot" data-file="{name}">{caption}<div class="drawing" '
        f'style="height:{height}px"></div>'
        f'<script type="application/json">{embedded(figure.to_plotly_json())}</script>{_take(name)}</figure>'
    )


def _take(name: str) -> str:
    buttons = "".join(
        f'<button type="button" data-take="{kind}" aria-label="{name} as {kind}">{kind.upper()}</button>'
        for kind in ("csv", "json")
    )
    return f'<div class="take">take the numbers: {buttons}</div>'


def _cell(value: Cell) -> str:
    if isinstance(value, str):
        return f"<td>{_shown(value)}</td>"
    if value is None:
        return '<td class="number" data-value="">not known</td>'
    return f'<td class="number" data-value="{value!r}">{_shown(value)}</td>'


def _shown(value: Cell) -> str:
    if value is None:
        return "not known"
    if isinstance(value, str):
        return escape(value)
    if isinstance(value, int) or (float(value).is_integer() and abs(value) >= 1000):
        return f"{value:,.0f}"
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _code(text: str) -> str:
    """Escaped, with the command at its end as one to type."""
    words, found, command = text.partition(" To have it: ")
    return escape(words) + (f" To have it: <code>{escape(command)}</code>" if found else "")


def embedded(value: Any) -> str:
    """JSON that may stand inside a script element."""
    text = json.dumps(_tidy(value), allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("&", "\\u0026")


def _tidy(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tidy(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_tidy(item) for item in value]
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
    return value
