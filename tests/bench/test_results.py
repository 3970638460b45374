"""Results as they are read back: of older ones, what they could not say yet is no difference."""

import json
from pathlib import Path
from typing import Any

import pytest

from irl.bench.cells import LATER, Cell, expand
from irl.bench.comparable import comparable
from irl.bench.grid import read_grid
from irl.bench.results import _reward, read_results
from irl.core.config import to_json

GRID = """
seeds = [1]
tasks = ["Own-v0"]
demos = [5]

[[part]]
methods = ["dac"]
steps = 1000

[[part]]
kind = "retrain"
methods = ["dac"]
shares = [1.0]
steps = 500
"""


@pytest.fixture
def cells(tmp_path: Path) -> list[Cell]:
    (path := tmp_path / "small.toml").write_text(GRID)
    return expand(read_grid(path))


def write(folder: Path, cell: Cell, said: Any = None) -> None:
    """A result of a cell, which says this of it."""
    of = {"method": cell.arm, "task": cell.task, "seed": cell.seed, "score": 0.5, "curve": [], "wall_s": 1.0}
    (folder / f"{cell.name}.json").write_text(json.dumps(of | {"cell": said or to_json(cell)}))


def test_a_retraining_of_a_source_by_other_settings_is_left_out(tmp_path: Path, cells: list[Cell]) -> None:
    (folder := tmp_path / "results").mkdir()
    for cell in cells:
        write(folder, cell)
    assert len(comparable(read_results(folder, cells), cells)[0]) == 2
    (grid := tmp_path / "small.toml").write_text(GRID.replace("steps = 1000", "steps = 2000"))
    longer = expand(read_grid(grid))
    write(folder, longer[0])
    (kept,), (note,) = comparable(read_results(folder, longer), longer)
    assert kept["file"] == "dac-own-d5-s1.json"
    assert "dac-own-d5-s1-ppo-on-100.json: source_steps was 1000 and is 2000" in note


def test_a_result_that_says_nothing_of_its_source_yet_is_kept(tmp_path: Path, cells: list[Cell]) -> None:
    (folder := tmp_path / "results").mkdir()
    older = {name: value for name, value in to_json(cells[1]).items() if name not in LATER}
    write(folder, cells[1], older)
    (kept,), notes = comparable(read_results(folder, cells), cells)
    assert (kept["cell"], notes) == (to_json(cells[1]), [])


def test_a_reward_that_could_not_be_judged_has_no_distance() -> None:
    reason = "no task is known, so nobody can say"
    assert _reward({}) is None
    assert (
        _reward({"distances": {"headline_reason": reason}, "reward": {}, "terms": {"reason": reason}}) is None
    )
