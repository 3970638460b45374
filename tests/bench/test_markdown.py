"""RESULTS.md says what its committed JSON comes to: each made part is made again and compared."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from irl.bench.arms import arm_averages, arms_of, scorer, speed
from irl.bench.cells import Cell, expand
from irl.bench.comparable import comparable
from irl.bench.estimate import all_results
from irl.bench.figure import curves
from irl.bench.grid import SHIPPED, Grid, read_grid
from irl.bench.markdown import section, summary
from irl.bench.results import read_results
from irl.bench.statistics import Estimate
from irl.bench.typeset import estimate
from irl.bench.written import marks, read_part
from irl.core.errors import UserError
from irl.policies import shelf

BENCHMARKS = Path(__file__).parents[2] / "scripts" / "benchmarks"
DOCUMENT = (BENCHMARKS / "RESULTS.md").read_text(encoding="utf-8")
PARTS = re.findall(re.escape(marks("X")[0]).replace("X", r"(\S+)"), DOCUMENT)


def grid_of(name: str) -> tuple[Grid | None, list[Cell]]:
    grid = read_grid(path) if (path := SHIPPED / f"{name}.toml").is_file() else None
    return grid, expand(grid) if grid else []


def rebuilt(name: str) -> str:
    grid, cells = grid_of(name)
    results, notes = comparable(read_results(BENCHMARKS / "results" / name, cells), cells)
    return section(name, results, grid, cells, notes)


def test_there_are_made_parts_and_one_for_each_grid_with_results() -> None:
    there = {path.stem for path in SHIPPED.glob("*.toml") if (BENCHMARKS / "results" / path.stem).is_dir()}
    assert {"dac", "airl", "airl-sac"} | there == set(PARTS)


@pytest.mark.parametrize("name", PARTS)
def test_its_numbers_are_those_of_the_json(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("IRL_POLICIES_PATH", raising=False)
    assert read_part(DOCUMENT, name) == rebuilt(name)
    figure = BENCHMARKS / "results" / name / "curves.svg"
    assert figure.read_text() == curves(
        comparable(read_results(figure.parent, cells := grid_of(name)[1]), cells)[0]
    )


def test_the_summary_in_readme_is_that_of_the_json() -> None:
    grid, cells = grid_of("core")
    readme = (BENCHMARKS.parents[1] / "README.md").read_text(encoding="utf-8")
    figure = "scripts/benchmarks/results/core/curves.svg"
    results, _ = comparable(read_results(BENCHMARKS / "results" / "core", cells), cells)
    made = summary("core", results, grid, figure)
    assert read_part(readme, "core summary") == made


def test_the_numbers_by_hand() -> None:
    # the scores and curves of the committed runs of AIRL on Hopper, calculated as a reader would
    results = [row for row in read_results(BENCHMARKS / "results" / "airl") if row["task"] == "Hopper-v5"]
    assert len(results) == 3
    (arm,) = arms_of(results)
    scores = [result["score"] for result in results]
    middle, mean = arm_averages(arm)
    assert (middle.value, mean.value) == (pytest.approx(np.mean(scores)), pytest.approx(np.mean(scores)))
    assert (mean.low, mean.high) == (pytest.approx(min(scores)), pytest.approx(max(scores)))
    random, expert = 15.520310598118709, 3701.9391168775146
    score = scorer(results[0])
    assert score((random + expert) / 2) == pytest.approx(0.5, abs=1e-6)
    half = (random + expert) / 2
    first = [next(step for step, value in result["curve"] if value >= half) for result in results]
    assert speed(results)[0][0] == np.median(first)


def test_results_without_a_score_or_an_interval_are_shown_as_unknown() -> None:
    result = {"method": "gail", "task": "Own-v0", "seed": 1, "demos": 3, "demo_rate": 20, "score": None}
    result |= {
        "env_steps": 10,
        "return_mean": 5.0,
        "wall_s": 2.0,
        "curve": [[10, 5.0]],
        "command": "irl train",
    }
    said = section("own", [result | {"file": "a.json"}], None, [])
    assert "| gail | 3, 1 step in 20 | 10 |  | 0 | - | - |" in said
    assert "| gail | Own | 1 | - | 5 | 2 s | - - - | - - - |" in said
    assert estimate(Estimate(0.5, math.nan, math.nan)) == ".500"
    assert estimate(Estimate(0.951, 0.9, 1.01)) == ".951 (.900 to 1.010)"


def test_results_of_another_grid_are_left_out_and_named() -> None:
    grid, cells = grid_of("core")
    results = read_results(BENCHMARKS / "results" / "core", cells)
    slower = [replace(c, steps=9) if c.name == "gail-ant-d5-s25" else c for c in cells]
    slower = [cell for cell in slower if cell.name != "bc-ant-d5-s21"]
    kept, notes = comparable(results, slower)
    assert {r["file"] for r in results} - {r["file"] for r in kept} == {
        "gail-ant-d5-s25.json",
        "bc-ant-d5-s21.json",
    }
    said = section("core", kept, grid, slower, notes)
    assert "29 of 59 cells have no result" in said
    assert "gail-ant-d5-s25.json: steps was 1000000 and is 9" in said
    assert "bc-ant-d5-s21.json: the grid has no such cell" in said
    with pytest.raises(UserError, match="no result is of a cell of grid core as it is now"):
        comparable(results[:1], cells[:1])


def a_result(task: str, score: float, expert: float, seed: int = 1) -> dict[str, Any]:
    return {
        "method": "gail",
        "task": task,
        "seed": seed,
        "demos": 3,
        "demo_rate": 1,
        "env_steps": 10,
        "wall_s": 2.0,
        "curve": [[10, 5.0]],
        "command": "irl train",
        "file": f"{seed}.json",
        "random_return": 0.0,
        "expert_return": expert,
        "return_mean": score * expert,
        "score": score,
    }


def test_a_task_is_scored_by_one_expert(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("IRL_POLICIES_PATH", raising=False)
    card = shelf.find("Hopper-v5").card
    random, expert = card.random_return_mean, card.measured.return_mean
    now = a_result("Hopper-v5", 0.5, expert) | {"random_return": random}
    then = a_result("Hopper-v5", 0.5, 1000.0, seed=2) | {"score_of_the_run": 0.4, "snapshot": 5}
    found, notes = comparable([now, then], [])
    assert found[0] == now
    assert found[1]["score"] == pytest.approx((500 - random) / (expert - random))
    assert (found[1]["expert_return"], found[1]["score_of_the_run"]) == (expert, None)
    assert len(notes) == 1
    assert f"Hopper-v5 was scored by different experts (returns of 1000 and {expert:.0f})" in notes[0]
    assert notes[0] in section("own", found, None, [], notes)
    assert comparable([then], []) == ([then], [])
    # no expert is known to score both by
    own = [a_result("Own-v0", 0.5, 10.0), a_result("Own-v0", 0.5, 20.0, seed=2)]
    assert comparable(own, []) == (
        own,
        ["Scores of Own-v0 are by different experts (returns of 10 and 20): not to be compared."],
    )


def test_an_interval_over_few_seeds_is_called_too_narrow() -> None:
    results = [a_result("Own-v0", 0.1 * seed, 10.0, seed) for seed in range(1, 6)]
    doubt = "Intervals over fewer than 5 seeds a task are too narrow"
    assert doubt in section("own", results[:4], None, [])
    assert doubt in summary("own", results[:4], None, "curves.svg")
    # one seed has no interval
    for n in (1, 5):
        assert doubt not in section("own", results[:n], None, [])


def test_a_folder_without_results_or_with_a_damaged_one_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="has no result yet; make them with: irl bench"):
        read_results(tmp_path)
    (tmp_path / "grid").mkdir()
    (tmp_path / "grid" / "a.json").write_text("{}")
    with pytest.raises(UserError, match="is no result of a cell: it lacks method, task"):
        read_results(tmp_path / "grid")
    assert all_results(tmp_path) == []


def test_a_run_that_went_on_elsewhere_names_both_places() -> None:
    (whole, *rest) = read_results(BENCHMARKS / "results" / "airl")
    resumed = [{"env_steps": 5, "git_commit": "beef" * 10}, {"env_steps": 9, "machine": "elsewhere"}]
    said = section("airl", [{**whole, "resumed": resumed}, *rest], None, [])
    assert ", beefbee" in said
    assert f"{whole['machine']}, {whole['device']}; elsewhere, {whole['device']}" in said


def test_a_curve_may_begin_before_the_first_step() -> None:
    row = {"method": "dac", "task": "Hopper-v5", "seed": 1, "demos": 5, "demo_rate": 1, "score": 1.0}
    drawn = curves([{**row, "curve": [[0, 15.5], [1000, 3702.0]]}])
    (points,) = re.findall(r'<polyline points="([^"]*)"', drawn)
    assert [float(point.split(",")[0]) for point in points.split()] == [0.0, 264.0]
