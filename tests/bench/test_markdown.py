"""RESULTS.md says what its committed JSON comes to: each made part is made again and compared."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from irl.bench.arms import arm_averages, arms_of, scorer, speed
from irl.bench.cells import Cell, expand
from irl.bench.comparable import of_grid
from irl.bench.estimate import all_results
from irl.bench.figure import curves
from irl.bench.grid import SHIPPED, Grid, read_grid
from irl.bench.markdown import section, summary
from irl.bench.results import read_results
from irl.bench.statistics import Estimate
from irl.bench.typeset import estimate
from irl.bench.written import marks, read_part
from irl.core.errors import UserError

BENCHMARKS = Path(__file__).parents[2] / "scripts" / "benchmarks"
DOCUMENT = (BENCHMARKS / "RESULTS.md").read_text(encoding="utf-8")
PARTS = re.findall(re.escape(marks("X")[0]).replace("X", r"(\S+)"), DOCUMENT)


def grid_of(name: str) -> tuple[Grid | None, list[Cell]]:
    grid = read_grid(path) if (path := SHIPPED / f"{name}.toml").is_file() else None
    return grid, expand(grid) if grid else []


def rebuilt(name: str) -> str:
    grid, cells = grid_of(name)
    results, left_out = of_grid(read_results(BENCHMARKS / "results" / name, cells), cells)
    return section(name, results, grid, cells, left_out)


def test_there_are_made_parts_and_one_for_each_grid_with_results() -> None:
    there = {path.stem for path in SHIPPED.glob("*.toml") if (BENCHMARKS / "results" / path.stem).is_dir()}
    assert {"dac", "airl", "airl-sac"} | there == set(PARTS)


@pytest.mark.parametrize("name", PARTS)
def test_its_numbers_are_those_of_the_json(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("IRL_POLICIES_PATH", raising=False)
    assert read_part(DOCUMENT, name) == rebuilt(name)
    figure = BENCHMARKS / "results" / name / "curves.svg"
    assert figure.read_text() == curves(read_results(figure.parent, grid_of(name)[1]))


def test_the_summary_in_readme_is_that_of_the_json() -> None:
    grid, cells = grid_of("core")
    readme = (BENCHMARKS.parents[1] / "README.md").read_text(encoding="utf-8")
    figure = "scripts/benchmarks/results/core/curves.svg"
    made = summary("core", read_results(BENCHMARKS / "results" / "core", cells), grid, figure)
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
    slower = [replace(c, steps=9) if c.name == "gail-ant-d5-s22" else c for c in cells]
    slower = [cell for cell in slower if cell.name != "bc-ant-d5-s21"]
    kept, left_out = of_grid(results, slower)
    assert {r["file"] for r in results} - {r["file"] for r in kept} == {
        "gail-ant-d5-s22.json",
        "bc-ant-d5-s21.json",
    }
    said = section("core", kept, grid, slower, left_out)
    assert "31 of 59 cells have no result" in said
    assert "gail-ant-d5-s22.json: steps was 1000000 and is 9" in said
    assert "bc-ant-d5-s21.json: the grid has no such cell" in said
    with pytest.raises(UserError, match="no result is of a cell of grid core as it is now"):
        of_grid(results[:1], cells[:1])


def test_a_folder_without_results_or_with_a_damaged_one_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="has no result yet; make them with: irl bench"):
        read_results(tmp_path)
    (tmp_path / "grid").mkdir()
    (tmp_path / "grid" / "a.json").write_text("{}")
    with pytest.raises(UserError, match="is no result of a cell: it lacks method, task"):
        read_results(tmp_path / "grid")
    assert all_results(tmp_path) == []
