"""The page of a run of which everything is known, of one of which nothing is, and of several."""

import dataclasses
import hashlib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from irl.core.errors import UserError
from irl.report.folder import RunFiles, read_run
from irl.report.html import NAMES, render, write_report, write_reports
from irl.report.markup import Page
from irl.report.panel import Panel
from irl.report.sections.agreement import agreement
from irl.report.sections.compare import compare
from irl.report.sections.crossplay import crossplay
from irl.report.sections.fan import fan
from irl.report.sections.gold import gold
from irl.report.sections.maps import maps
from irl.report.sections.moved import moved
from irl.report.sections.trust import trust
from irl.report.sections.verdicts import verdicts
from irl.report.sections.viewer import viewer
from irl.report.sections.weights import weights
from irl.report.summary import summary
from tests.report import whole


@pytest.fixture
def everything(run: Path, evaluation: dict[str, Any]) -> Path:
    whole.write(run, whole.grow(evaluation, 9))
    return run


def missing(page: str) -> set[str]:
    return set(re.findall(r'data-section="([a-z]+)" class="missing"', page))


def figures(page: str) -> list[dict[str, Any]]:
    found = re.findall(
        r'<figure class="plot".*?<script type="application/json">(.*?)</script>', page, re.DOTALL
    )
    return [json.loads(text) for text in found]


def test_every_section_is_there_in_the_order_of_the_page(everything: Path) -> None:
    page = write_report(everything).read_text()
    assert re.findall(r'data-section="([a-z]+)"', page) == [*NAMES, "notes", "how"]
    assert missing(page) == set()
    assert "Not shown" not in page
    assert len(page) < 8_000_000


def test_numbers_of_the_page_are_those_of_the_file(everything: Path) -> None:
    page = write_report(everything).read_text()
    evaluation = json.loads((everything / "evaluation.json").read_text())
    for value in ("0.2174", "0.0125", "-4.375", "0.375", "0.875"):
        assert f'data-value="{value}"' in page or f"<b>{value}</b>" in page, value
    drawn = figures(page)
    heat = next(f for f in drawn if f["data"][0]["type"] == "heatmap")
    first = evaluation["drift"]["pictures"]["maps"][0]["matrix"]
    assert [v for row in heat["data"][0]["z"] for v in row] == pytest.approx(
        [v for row in first for v in row], rel=1e-5
    )
    gold = next(f for f in drawn if f["data"][0].get("name") == "proxy: learned return")
    assert gold["data"][1]["y"] == [row["gold"] for row in evaluation["proxy_gold"]["points"]]
    weights = hashlib.sha256(b"weights").hexdigest()
    assert weights in page


@pytest.mark.parametrize(
    ("gone", "section"),
    [("cross_play", crossplay), ("proxy_gold", gold), ("episodes", viewer), ("terms", weights)],
)
def test_a_section_without_data_is_named_with_what_to_type(
    run: Path, evaluation: dict[str, Any], gone: str, section: Callable[[RunFiles], Panel]
) -> None:
    known = whole.grow(evaluation, 3)
    del known[gone]
    whole.write(run, known)
    panel = section(read_run(run))
    assert panel.missing
    said = "Not shown: this evaluation was written without it. To have it: irl evaluate quickstart"
    assert panel.text == said
    assert "<code>irl evaluate quickstart</code>" in Page().section(panel)


def test_an_evaluation_of_before_gives_what_it_holds(run: Path) -> None:
    page = write_report(run).read_text()
    assert missing(page) == {"map", "terms", "episodes", "crossplay", "gold", "retrain"}
    assert "irl retrain quickstart" in page


def test_a_run_that_is_not_judged_yet_shows_its_curves(run: Path) -> None:
    (run / "evaluation.json").unlink()
    page = write_report(run).read_text()
    assert not missing(page) & {"policy", "moved", "trust"}
    assert {"verdicts", "fan", "map", "episodes"} <= missing(page)
    assert "was not judged yet" in page


def compare_one(run: RunFiles) -> Panel:
    return compare([run])


READERS = {
    "verdicts": [verdicts],
    "chosen": [verdicts],
    "distances": [maps, trust, summary],
    "terms": [weights],
    "residual": [weights],
    "ledger": [trust],
    "episodes": [viewer],
    "proxy_gold": [gold],
    "cross_play": [crossplay],
    "snapshots": [fan, maps, moved],
    "moves": [moved],
    "health": [moved],
    "to_truth": [compare_one],
    "outside": [trust],
    "fan": [fan],
    "maps": [maps],
    "against": [agreement],
    "residuals": [agreement],
}
"""Who reads a part of the evaluation, by its first name or by that within `drift` and its `pictures`."""
FILLERS = (None, "text", {}, [None], True, -1)


def holes(value: Any) -> list[tuple[str | int, ...]]:
    """The way to everything in it; of a list to its first item."""
    items = (
        value.items() if isinstance(value, dict) else enumerate(value[:1]) if isinstance(value, list) else ()
    )
    return [path for key, item in items for path in [(key,), *((key, *rest) for rest in holes(item))]]


def test_any_part_may_be_damaged(run: Path, evaluation: dict[str, Any]) -> None:
    known = whole.grow(evaluation, 3)
    whole.write(run, known)
    files = read_run(run)
    of_before = ("reward", "policy", "references", "changes", "strata", "auroc")
    # some ways and another filler each time: all ways at all fillers would take minutes
    for i, path in enumerate(holes({key: known[key] for key in known if key not in of_before})[::15]):
        named = [str(key) for key in path if key not in ("drift", "pictures")]
        if not named or named[0] in of_before or named[0] not in READERS:
            continue
        holed = json.loads(json.dumps(known))
        parent = holed
        for key in path[:-1]:
            parent = parent[key]
        parent[path[-1]] = FILLERS[i % len(FILLERS)]
        for section in READERS[named[0]]:
            assert section(dataclasses.replace(files, evaluation=holed)), path


@pytest.mark.parametrize(
    "file",
    ["../evaluation.json", "/etc/hostname", "episodes/none.webp", "evaluation.json", "episodes/../x.webp"],
)
def test_pictures_are_taken_from_the_run_alone(run: Path, evaluation: dict[str, Any], file: str) -> None:
    known = whole.grow(evaluation, 4)
    known["episodes"][0]["film"]["file"] = file
    whole.write(run, known)
    html = "".join(view.html for view in viewer(read_run(run)).views)
    assert "No pictures: " in html
    assert "data:image" not in html


def test_several_runs_lie_beside_each_other(everything: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    config = {"kind": "airl", "env_id": "Hopper-v5", "seed": 1}
    (other / "config.json").write_text(json.dumps(config))
    (other / "metrics.jsonl").write_bytes((everything / "metrics.jsonl").read_bytes())
    page = write_reports([everything, other, everything], tmp_path / "many.html").read_text()
    assert page.count("plotly.js v") == 1
    assert 'id="run0-policy"' in page
    assert 'id="run1-policy"' in page
    assert "says little with fewer than 5 of them" in page
    overlay = figures(page)[0]["data"]
    thick = [trace["name"] for trace in overlay if trace["line"]["width"] == 3]
    assert thick == ["gail, Hopper-v5 (2 runs)", "airl, Hopper-v5 (1 run)"]
    assert len({trace["line"]["color"] for trace in overlay}) == 4


def test_what_belongs_to_one_of_several_runs_stays_with_it(
    run: Path, evaluation: dict[str, Any], tmp_path: Path
) -> None:
    known = whole.grow(evaluation, 4)
    known["episodes"] *= 2
    whole.write(run, known)
    page = write_reports([run, run], tmp_path / "two.html").read_text()
    ids = re.findall(r'<[a-z0-9]+ [^>]*?\bid="([^"]*)"', page)
    assert len(set(ids)) == len(ids)
    assert {"run0-episodes-tab-1", "run1-episodes-tab-1"} <= set(ids)
    pointed = re.findall(r'(?:href="#|aria-controls="|aria-labelledby=")([^"]+)"', page)
    assert {"run1-crossplay", "how"} <= set(pointed) <= set(ids)


def test_no_run_is_no_report(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="name the run folders"):
        write_reports([], tmp_path / "x.html")


def test_a_watched_page_reads_itself_again(run: Path) -> None:
    assert 'http-equiv="refresh" content="7"' in render([read_run(run)], 7)
    assert 'http-equiv="refresh"' not in render([read_run(run)])
