"""One page of a run or of several: `report.html`, which needs no network and no other file.

Every string that comes from a file is escaped, and the page forbids itself to load anything.
"""

from collections.abc import Callable, Sequence
from html import escape
from importlib.resources import files as resources
from pathlib import Path

from plotly.offline import get_plotlyjs

from irl.core import files
from irl.core.errors import UserError
from irl.report.folder import RunFiles, read_run
from irl.report.header import head_of, header, notes, settings
from irl.report.how import explained
from irl.report.markup import Page, controlled
from irl.report.panel import Panel, absent
from irl.report.sections.agreement import agreement
from irl.report.sections.compare import compare
from irl.report.sections.crossplay import crossplay
from irl.report.sections.fan import fan
from irl.report.sections.gold import gold
from irl.report.sections.maps import maps
from irl.report.sections.moved import moved
from irl.report.sections.policy import policy
from irl.report.sections.transfer import transfer
from irl.report.sections.trust import trust
from irl.report.sections.verdicts import verdicts
from irl.report.sections.viewer import viewer
from irl.report.sections.weights import weights

SECTIONS: tuple[Callable[[RunFiles], Panel], ...] = (
    verdicts,
    policy,
    moved,
    fan,
    maps,
    weights,
    agreement,
    viewer,
    crossplay,
    gold,
    transfer,
    trust,
)
"""In the order of the page."""
NAMES = {
    "verdicts": "Verdicts",
    "policy": "Policy",
    "moved": "What moved",
    "fan": "Reward by play",
    "map": "Map",
    "terms": "Terms",
    "against": "Agreement",
    "episodes": "Episodes",
    "crossplay": "Cross-play",
    "gold": "Proxy and gold",
    "retrain": "Retrain",
    "trust": "Trust",
}
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
MOST_BYTES = 8_000_000
"""What a page may weigh; further runs are left out of it, and said."""


def write_report(run: Path) -> Path:
    """The path of the `report.html` written into the run folder `run`, from its files alone.

    What is missing or damaged becomes a sentence on the page.

    Raises:
        UserError: there is no such folder.
    """
    return write_reports([run], run / "report.html")


def write_reports(runs: Sequence[Path], target: Path, refresh_s: int | None = None) -> Path:
    """The page of one or several runs, written to `target`.

    Args:
        refresh_s: seconds after which a browser reads the page again; never, unless given.

    Raises:
        UserError: one of the folders is not there, or none is named.
    """
    if not runs:
        raise UserError("name the run folders that the report is about")
    files.write_bytes(target, render([read_run(run) for run in runs], refresh_s).encode())
    return target


def render(runs: Sequence[RunFiles], refresh_s: int | None = None) -> str:
    """The page as text."""
    body = _single(runs[0]) if len(runs) == 1 else _several(runs)
    script = f"<script>{get_plotlyjs()}</script><script>{_own('page.js')}</script>"
    title = runs[0].name if len(runs) == 1 else f"{len(runs)} runs"
    again = "" if refresh_s is None else f'<meta http-equiv="refresh" content="{refresh_s}">'
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">{again}'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}: report</title><style>{_own('page.css')}</style></head>"
        f'<body><a class="skip" href="#main">To the content</a><main id="main">{body}{explained()}'
        "<noscript><p class='absent'>The figures are drawn by a script in this file.</p></noscript>"
        "<footer>Written by irl from the files of the run folder; write it again with "
        f"<code>irl report</code>.</footer></main>{script}</body></html>\n"
    )


def _single(run: RunFiles) -> str:
    return header(run) + _sections(run, Page())


def _sections(run: RunFiles, page: Page, prefix: str = "", pictures: bool = True) -> str:
    shown = [_safe(maker, run, pictures) for maker in SECTIONS]
    links = "".join(
        f'<a href="#{prefix}{panel.anchor}"{_MISSING if panel.missing else ""}>{NAMES[panel.anchor]}</a>'
        for panel in shown
    )
    sections = "".join(page.section(panel, prefix) for panel in shown)
    nav = f'<nav aria-label="sections">{links}<a href="#how">How</a></nav>'
    return nav + sections + notes(run, prefix) + settings(run)


_MISSING = ' class="missing" title="not shown: see there"'


def _safe(maker: Callable[[RunFiles], Panel], run: RunFiles, pictures: bool) -> Panel:
    """A section, or that the files of this one are damaged: a report of half a run is better than none."""
    name = {
        "maps": "map",
        "weights": "terms",
        "agreement": "against",
        "viewer": "episodes",
        "transfer": "retrain",
    }
    try:
        return viewer(run, pictures) if maker is viewer else maker(run)
    except (
        TypeError,
        ValueError,
        KeyError,
        IndexError,
        AttributeError,
        OverflowError,
        ZeroDivisionError,
    ) as error:
        anchor = name.get(maker.__name__, maker.__name__)
        reason = f"what the run folder holds of it cannot be read ({type(error).__name__})"
        return absent(anchor, NAMES[anchor], reason, f"irl evaluate {run.name}")


def _several(runs: Sequence[RunFiles]) -> str:
    """The comparison, and a tab a run."""
    page = Page()
    parts = [head_of(runs), page.section(compare(runs))]
    names, bodies = [], []
    left = MOST_BYTES - len(get_plotlyjs().encode()) - 200_000
    for i, run in enumerate(runs):
        body = header(run) + _sections(run, page, f"run{i}-", pictures=False)
        left -= len(body.encode())
        if left < 0:
            reason = f"Not shown: the page would be too large. To have it: irl report {run.name}"
            body = f'<p class="absent">{escape(reason)}</p>'
        names.append(run.name)
        bodies.append(f"<div>{body}</div>")
    return "".join(parts) + controlled("runs", names, bodies, "tabs", "runs")


def _own(name: str) -> str:
    """A file of this package."""
    return resources("irl.report").joinpath(name).read_text(encoding="utf-8")
