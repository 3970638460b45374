"""One page of a run: `report.html`, which needs no network and no other file.

Every string that comes from a file is escaped, and the page forbids itself to load anything.
"""

from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Any

from plotly.offline import get_plotlyjs

from irl.core import files
from irl.report.folder import RunFiles, lookup, number, read_run, texts
from irl.report.header import header, settings
from irl.report.palette import STRATA, STRATUM_NAMES
from irl.report.panels import Panel, panels
from irl.report.readings import MISSING, amount, key_numbers, spread
from irl.report.style import CSS

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
PLOTLY = {"responsive": True, "displayModeBar": False}


def write_report(run: Path) -> Path:
    """The path of the `report.html` written into the run folder `run`, from its files alone.

    What is missing or damaged becomes a sentence on the page.

    Raises:
        UserError: there is no such folder.
    """
    target = run / "report.html"
    files.write_bytes(target, render(read_run(run)).encode())
    return target


def render(run: RunFiles) -> str:
    """The page as text."""
    shown = panels(run)
    script = f"<script>{get_plotlyjs()}</script>" if any(panel.figure for panel in shown) else ""
    body = [header(run), _numbers(run), *(_section(panel) for panel in shown), _notes(run), settings(run)]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(run.name)}: report</title><style>{CSS}</style>{script}</head>"
        f"<body><main>{''.join(body)}"
        "<noscript><p class='absent'>The figures are drawn by a script in this file.</p></noscript>"
        "<footer>Written by irl from the files of the run folder; write it again with "
        "<code>irl evaluate</code>.</footer></main></body></html>\n"
    )


def _numbers(run: RunFiles) -> str:
    if not run.evaluation:
        reason = run.problems.get("evaluation.json", "evaluation.json is empty")
        return _titled("numbers", "Key numbers", _absent(f"Not shown: {reason}. `irl evaluate` writes it."))
    rows = "".join(
        f'<tr><th scope="row">{escape(row.name)}</th>'
        f'<td class="value{" unknown" if row.value == MISSING else ""}">{escape(row.value)}</td>'
        f'<td class="says">{escape(row.reading)}</td></tr>'
        for row in key_numbers(run.evaluation)
    )
    head = "<thead><tr><th>Measured</th><th>Value</th><th>What it says</th></tr></thead>"
    table = f'<table class="keys">{head}<tbody>{rows}</tbody></table>'
    return _titled("numbers", "Key numbers", table + _strata(run))


def _strata(run: RunFiles) -> str:
    strata = lookup(run.evaluation, "reward.strata")
    if not isinstance(strata, Mapping):
        return ""
    rows = []
    for name in STRATA:
        mean, std = number(strata, f"{name}.mean"), number(strata, f"{name}.std")
        steps, hand_written = number(strata, f"{name}.steps"), number(strata, f"{name}.hand_written_mean")
        within = number(strata, f"{name}.pearson")
        cells = (
            MISSING if mean is None else spread(mean, std),
            MISSING if hand_written is None else amount(hand_written),
            MISSING if within is None else f"{within:.2f}",
            MISSING if steps is None else f"{steps:,.0f}",
        )
        dot = f'<span class="dot" style="background:{STRATA[name]}"></span>'
        rows.append(f'<tr><th scope="row">{dot}{STRATUM_NAMES[name]}</th>{_cells(cells)}</tr>')
    columns = ("Mean reward of a step", "learned", "hand-written", "Pearson within", "steps")
    head = f"<tr>{''.join(f'<th>{column}</th>' for column in columns)}</tr>"
    return f'<table class="strata"><thead>{head}</thead><tbody>{"".join(rows)}</tbody></table>'


def _cells(values: Iterable[str]) -> str:
    return "".join(f"<td>{escape(value)}</td>" for value in values)


def _section(panel: Panel) -> str:
    if panel.figure is None:
        return _titled(panel.anchor, panel.title, _absent(panel.text))
    figure = panel.figure.to_html(
        full_html=False, include_plotlyjs=False, config=PLOTLY, div_id=f"figure-{panel.anchor}"
    )
    return _titled(panel.anchor, panel.title, f'<p class="reading">{escape(panel.text)}</p>{figure}')


def _notes(run: RunFiles) -> str:
    notes = [
        note for part in ("policy", "reward", "drift", "") for note in texts(_part(run, part).get("notes"))
    ]
    notes += [problem for name, problem in run.problems.items() if name != "evaluation.json" or notes]
    if not notes:
        return ""
    items = "".join(f"<li>{escape(note)}</li>" for note in dict.fromkeys(notes))
    return _titled("notes", "Notes", f"<ul>{items}</ul>")


def _part(run: RunFiles, path: str) -> Mapping[str, Any]:
    found = lookup(run.evaluation, path)
    return found if isinstance(found, Mapping) else {}


def _titled(anchor: str, title: str, content: str) -> str:
    return f'<section id="{anchor}"><h2>{escape(title)}</h2>{content}</section>'


def _absent(text: str) -> str:
    return f'<p class="absent">{escape(text)}</p>'
