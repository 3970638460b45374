"""A grid's file: what it may say, what it means, and what is refused with a name."""

from pathlib import Path

import pytest

from irl.bench.cells import LATER, completed, expand, only
from irl.bench.grid import SHIPPED, Given, find_grid, read_grid
from irl.core.config import to_json
from irl.core.differences import differences
from irl.core.errors import UserError

SMALL = """
title = "small"
seeds = [1, 2]
tasks = ["Hopper-v5"]
demos = [5, { episodes = 4, rate = 20 }]

[[part]]
methods = ["dac", "gail"]
steps = 1000
settings = { "learner.lr" = 1e-3, "learner.hidden" = [64, 64], "watch.tensorboard" = false }

[[part]]
methods = ["gail"]
variant = "slow"
tasks = ["Walker2d-v5"]
demos = [1]
seeds = [7]
steps = 50

[[part]]
kind = "retrain"
methods = ["dac"]
demos = [5]
seeds = [2]
steps = 500
"""


def write(folder: Path, text: str) -> Path:
    (path := folder / "small.toml").write_text(text)
    return path


def test_a_grid_is_the_product_of_its_parts_with_what_stands_at_the_top(tmp_path: Path) -> None:
    grid = read_grid(write(tmp_path, SMALL))
    assert grid.name == "small"
    assert grid.part[0].demos == (Given(5), Given(4, 20))
    cells = {cell.name: cell for cell in expand(grid)}
    assert len(cells) == 2 * 2 * 2 + 1 + 2
    thinned = cells["gail-hopper-d4x20-s2"]
    said = "--env-id Hopper-v5 --demo-episodes 4 --demo-rate 20 --steps 1000 --seed 2 --learner.lr 0.001"
    assert " ".join(thinned.words) == said + " --learner.hidden 64 64 --watch.no-tensorboard"
    slow = cells["gail-slow-walker2d-d1-s7"]
    assert (slow.arm, slow.method) == ("gail slow", "gail")
    half = cells["dac-hopper-d5-s2-ppo-on-50"]
    assert (half.source, half.share, half.arm) == ("dac-hopper-d5-s2", 0.5, "ppo on dac at 50%")
    assert half.words == ("--algo", "ppo", "--steps", "500")


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ("steps = 1000", "steps = 2000", "source_steps was 1000 and is 2000"),
        ('"learner.lr" = 1e-3', '"learner.lr" = 1e-4', "source_words was ['dac', "),
    ],
)
def test_a_retraining_on_what_was_learned_otherwise_is_another_cell(
    tmp_path: Path, before: str, after: str, complaint: str
) -> None:
    (was,) = only(expand(read_grid(write(tmp_path, SMALL))), ["on-50"])[1:]
    (now,) = only(expand(read_grid(write(tmp_path, SMALL.replace(before, after)))), ["on-50"])[1:]
    assert differences(to_json(was), to_json(now))[0].startswith(complaint)
    older = {name: value for name, value in to_json(was).items() if name not in LATER}
    assert completed(older, now) == to_json(now)
    assert completed(to_json(was), now) == to_json(was)
    assert completed([], now) == []


def test_only_some_cells_bring_the_runs_that_they_need(tmp_path: Path) -> None:
    cells = expand(read_grid(write(tmp_path, SMALL)))
    assert [cell.name for cell in only(cells, ["on-100"])] == [
        "dac-hopper-d5-s2",
        "dac-hopper-d5-s2-ppo-on-100",
    ]
    assert only(cells, []) == cells
    with pytest.raises(
        UserError, match="--only nothing: no cell's name has it; a name is like dac-hopper-d5-s1"
    ):
        only(cells, ["nothing"])


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ("steps = 1000", "steps = 0", "steps must be at least 1, not 0"),
        ("steps = 1000", "step = 1000", "unknown step"),
        ("seeds = [1, 2]", "seeds = [1, 1]", "seeds names one twice"),
        ("seeds = [1, 2]", "seeds = [-1]", "seed must be in 0"),
        ("seeds = [1, 2]", "", "a part needs seeds: none are given"),
        ('"dac", "gail"', '"../dac"', "cannot be part of a file's name"),
        ('"Hopper-v5"', "5", "expected str, found 5"),
        ("rate = 20", "rate = 0", "rate must be at least 1"),
        ("demos = [5, {", "demos = [0, {", "episodes must be at least 1, not 0"),
        ('kind = "retrain"', 'kind = "rerun"', "kind is one of train, retrain, peer, found 'rerun'"),
        ("[[part]]", "[part]", "not readable TOML"),
        ('title = "small"', 'name = "big"', "called as its file is; leave name = 'big' away"),
        ('variant = "slow"', "", "two cells called|unknown"),
        ("steps = 500", "steps = 500\nshares = [1.5]", "each in 0 to 1"),
        ('"learner.lr" = 1e-3', "seed = 3", "settings has seed, which would contradict .* write seeds ="),
        ('"learner.lr" = 1e-3', "env_id = 'Ant-v5'", "settings has env_id, .* write tasks = "),
        ('"learner.lr" = 1e-3', "demo-episodes = 1", "settings has demo-episodes, .* write demos = "),
        ('"learner.lr" = 1e-3', "steps = 1", "settings has steps, .* write steps = "),
        (
            'methods = ["dac"]',
            'methods = ["airl"]',
            "retrains on the reward of airl-hopper-d5-s2, which no part",
        ),
    ],
)
def test_what_a_grid_cannot_be_is_said(tmp_path: Path, before: str, after: str, complaint: str) -> None:
    text = SMALL.replace(before, after)
    if before.startswith("variant"):
        text = text.replace('tasks = ["Walker2d-v5"]\ndemos = [1]\nseeds = [7]\n', "")
    with pytest.raises(UserError, match=complaint):
        expand(read_grid(write(tmp_path, text)))


@pytest.mark.parametrize("other", ["steps = 2000", 'steps = 1000\nsettings = { preset = "fast" }'])
def test_seeds_of_one_arm_differ_in_the_seed_alone(tmp_path: Path, other: str) -> None:
    shared = '[[part]]\nmethods = ["dac"]\ntasks = ["Hopper-v5"]\ndemos = [5]\n'
    text = f"{shared}seeds = [1]\nsteps = 1000\n{shared}seeds = [2]\n"
    assert len(expand(read_grid(write(tmp_path, f"{text}steps = 1000\n")))) == 2
    assert len(expand(read_grid(write(tmp_path, f'{text}{other}\nvariant = "other"')))) == 2
    with pytest.raises(UserError, match="take for seeds of one method; give one of their parts a variant"):
        expand(read_grid(write(tmp_path, f"{text}{other}\n")))


def test_a_grid_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no grid 'cores'; there are core, few, peer, reward, or name a file"):
        find_grid("cores")
    with pytest.raises(UserError, match=r"no grid file .*none\.toml"):
        read_grid(find_grid(str(tmp_path / "none.toml")))
    with pytest.raises(UserError, match=r"has no \[\[part\]\]"):
        read_grid(write(tmp_path, "title = 'x'"))


@pytest.mark.parametrize(("name", "cells"), [("core", 60), ("peer", 16), ("reward", 36), ("few", 12)])
def test_the_shipped_grids_are_as_large_as_they_say(name: str, cells: int) -> None:
    assert len(expand(read_grid(find_grid(name)))) == cells
    assert {path.stem for path in SHIPPED.glob("*.toml")} == {"core", "peer", "reward", "few"}
