"""The page in a browser: no complaint, no request, every section drawn, controls that react.

Not among the ordinary tests: `make test-browser` brings the browser and runs these.
"""

import json
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path
from time import monotonic, sleep

import pytest

from irl.report.html import NAMES, write_report, write_reports
from tests.browser.chromium import ANSWERS_S, Tab, chromium
from tests.report import whole
from tests.report.conftest import a_run, an_evaluation

pytestmark = pytest.mark.browser
SNAPSHOTS = 50


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a run with fifty snapshots of which everything is known."""
    evaluation = an_evaluation()
    run = a_run(tmp_path_factory.mktemp("browser"), evaluation)
    whole.write(run, whole.grow(evaluation, SNAPSHOTS))
    return write_report(run)


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    with chromium() as opened:
        yield opened


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_everything_is_drawn_without_complaint_or_request(
    page: Path, tab: Tab, scheme: str, width: int
) -> None:
    tab.look(scheme, width, 900)
    seconds = tab.open(page)
    size = f"{page.stat().st_size / 1e6:.1f} MB, {scheme}, {width} wide"
    print(f"\n{SNAPSHOTS} snapshots, {size}: {seconds:.2f} s")
    tab.scroll_through()
    assert tab.complaints == []
    assert tab.requests == []
    sections = tab.run("[...document.querySelectorAll('[data-section]')].map((s) => s.dataset.section)")
    assert sections == [*NAMES, "notes", "how"]
    assert tab.run("document.querySelectorAll('.absent').length") == 0
    shown = "[...document.querySelectorAll('figure.plot')].filter((f) => f.offsetParent)"
    assert tab.run(f"{shown}.filter((f) => !f.querySelector('svg path')).length") == 0
    filled = "[...document.querySelectorAll('tbody')].every((body) => body.rows.length > 0)"
    assert tab.run(filled)
    # nothing hangs over the edge of a phone
    assert tab.run("document.documentElement.scrollWidth <= innerWidth")


def test_the_slider_shows_another_map(page: Path, tab: Tab) -> None:
    tab.open(page)
    moved = (
        "(() => { const input = document.querySelector('#map input'); input.value = 0;"
        "input.dispatchEvent(new Event('input')); return [document.querySelector('#map output').textContent,"
        "[...document.querySelectorAll('#map .view')].map((view) => view.hidden),"
        "document.querySelectorAll('#map .view:not([hidden]) .main-svg').length > 0]; })()"
    )
    assert tab.run("document.querySelector('#map output').textContent") == "50 steps"
    assert tab.run(moved) == ["1 step", [False, True, True], True]


def test_tabs_move_by_mouse_and_by_arrow(page: Path, tab: Tab) -> None:
    tab.open(page)
    shown = "[...document.querySelectorAll('#fan .view')].map((view) => !view.hidden)"
    assert tab.run(shown) == [True, False]
    tab.run("document.querySelectorAll('#fan [role=tab]')[1].click()")
    assert tab.run(shown) == [False, True]
    tab.run("document.querySelectorAll('#fan [role=tab]')[1].focus()")
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key="ArrowRight", code="ArrowRight")
    assert tab.run(shown) == [True, False]
    assert tab.run("document.activeElement.getAttribute('aria-selected')") == "true"


def test_one_cursor_moves_pictures_traces_and_numbers(page: Path, tab: Tab) -> None:
    tab.open(page)
    tab.scroll_through()
    tab.run("document.querySelector('#episodes').scrollIntoView()")
    pixels = "document.querySelector('#episodes canvas').getContext('2d').getImageData(5, 5, 1, 1).data[3]"
    assert tab.run(f"new Promise((done) => setTimeout(() => done({pixels}), 300))") == 255
    tab.run("document.querySelector('.episode').moveTo(7)")
    first = "document.querySelector('.readout tbody').rows[0].cells[1].textContent"
    series = "JSON.parse(document.querySelector('.episode-data').textContent).series.learned[7]"
    assert float(tab.run(first)) == pytest.approx(tab.run(series), rel=1e-3)
    lines = "[...document.querySelectorAll('.episode .drawing')].map((place) => place.layout.shapes[0].x0)"
    assert tab.run(lines) == [7, 7]


def test_every_number_can_be_taken(page: Path, tab: Tab) -> None:
    tab.open(page)
    taken = (
        "(async () => { const texts = []; const kept = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => { texts.push(blob.text()); return kept(blob); };"
        "HTMLAnchorElement.prototype.click = () => {};"
        "document.querySelectorAll('[data-take]').forEach((button) => button.click());"
        "return (await Promise.all(texts)).map((text) => text.length); })()"
    )
    lengths = tab.run(taken)
    assert len(lengths) == tab.run("document.querySelectorAll('[data-take]').length")
    assert min(lengths) > 20


def test_links_to_how_it_is_calculated_lead_somewhere(page: Path, tab: Tab) -> None:
    tab.open(page)
    links = "[...document.querySelectorAll('a[href^=\"#\"]')].map((a) => a.getAttribute('href'))"
    assert tab.run(f"{links}.filter((there) => !document.querySelector(there))") == []
    assert tab.run("document.querySelectorAll('a.how').length") >= 11


def test_runs_beside_each_other_are_tabs(page: Path, tab: Tab, tmp_path: Path) -> None:
    many = write_reports([page.parent, page.parent], tmp_path / "many.html")
    tab.open(many)
    tab.run("[...document.querySelectorAll('#runs-tab-1')][0].click()")
    tab.scroll_through()
    assert tab.run("document.querySelector('#run1-policy .main-svg') !== null")
    assert tab.complaints == []


def test_a_watched_page_reads_itself_again(tab: Tab, tmp_path: Path) -> None:
    run = a_run(tmp_path, an_evaluation())
    watched = write_reports([run], tmp_path / "watched.html", refresh_s=2)
    tab.open(watched)
    (run / "evaluation.json").write_text(json.dumps(an_evaluation() | {"run": "it went on"}))
    write_reports([run], watched, refresh_s=2)
    began = monotonic()
    while tab.run("document.querySelector('h1')?.textContent") != "it went on":
        assert monotonic() - began < ANSWERS_S, "the page stood still"
        sleep(0.1)


def test_paper_has_every_figure_without_a_scroll(page: Path, tab: Tab) -> None:
    tab.open(page)
    assert len(b64decode(tab.call("Page.printToPDF", printBackground=True)["data"])) > 100_000
    shown = "[...document.querySelectorAll('figure.plot')].filter((f) => f.offsetParent)"
    assert tab.run(f"{shown}.filter((f) => !f.querySelector('svg path')).length") == 0
    assert tab.complaints == []


def test_a_page_of_nothing_has_its_reasons(tab: Tab, tmp_path: Path) -> None:
    tab.open(write_report(tmp_path))
    assert tab.complaints == []
    assert tab.run("document.querySelectorAll('.absent').length") > 5
