"""`irl bench`: a grid on the point mass, its commands played here: what resumes, fails, is kept."""

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree

import pytest

from irl.bench import worker
from irl.bench.cells import LATER, expand, only
from irl.bench.grid import read_grid
from irl.bench.leash import PROGRAM
from irl.bench.processes import Processes
from irl.bench.written import marks
from irl.core.config import to_json
from irl.experiment.cli import main
from tests.experiment.conftest import SETTINGS, TASK

Command = Callable[..., None]
QUICK = {name: value for name, value in SETTINGS.items() if name != "steps"}
ADVERSARIAL = ", ".join(f'"{name}" = {value}' for name, value in QUICK.items())
PPO = ", ".join(
    f'"{name.replace("learner.", "ppo.")}" = {v}' for name, v in QUICK.items() if "learner" in name
)
GRID = f"""
title = "a point on a line"
seeds = [21, 22]
tasks = ["{TASK}"]
demos = [2]
evaluate = "--episodes 2 --probe-steps 60"
not_shown = ["anything about tasks with legs"]

[[part]]
methods = ["gail"]
steps = 512
settings = {{ {ADVERSARIAL} }}

[[part]]
methods = ["bc"]
steps = 40
settings = {{ "learner.steps-per-round" = 20 }}

[[part]]
kind = "retrain"
methods = ["gail"]
seeds = [21]
shares = [1.0]
steps = 256
settings = {{ {PPO} }}
"""


@pytest.fixture
def commands(home: Path, irl: Command, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """The commands of cells, each of which is played here."""
    played: list[tuple[str, ...]] = []

    def run(self: Processes, words: Sequence[str], log: Path, env: object = None) -> int:
        said = tuple(words[len(PROGRAM) :])
        played.append(said)
        try:
            main(said)
        except SystemExit as stop:
            log.write_text("irl: it was refused\n")
            return int(stop.code or 0)
        return 0

    monkeypatch.setattr(worker.Processes, "run", run)
    Path("small.toml").write_text(GRID)
    return played


@pytest.fixture
def bench(home: Path, irl: Command, commands: list) -> Command:
    where = ("--results", "results", "--runs", "runs", "--datasets-root", str(home / "datasets"))
    return lambda *words: irl("bench", "small.toml", *where, "--workers", "1", *words)


def test_a_grid_is_carried_out_once_and_its_tables_are_made_from_what_it_leaves(
    irl: Command, bench: Command, commands: list, capsys: pytest.CaptureFixture
) -> None:
    bench("--estimate")
    assert (commands, Path("results").exists()) == ([], False)
    assert "5 cells to do, 0 done" in " ".join(capsys.readouterr().err.split())
    bench()
    names = {path.stem: json.loads(path.read_text()) for path in Path("results/small").glob("*.json")}
    assert sorted(names) == [
        "bc-pointmass-d2-s21",
        "bc-pointmass-d2-s22",
        "gail-pointmass-d2-s21",
        "gail-pointmass-d2-s21-ppo-on-100",
        "gail-pointmass-d2-s22",
    ]
    gail, retrained = names["gail-pointmass-d2-s21"], names["gail-pointmass-d2-s21-ppo-on-100"]
    assert gail["command"].startswith("irl train gail --env-id PointMass-v0 --demo-episodes 2 --steps 512")
    assert (gail["method"], gail["demos"], gail["env_steps"], gail["threads"]) == ("gail", 2, 512, 1)
    assert [steps for steps, _ in gail["curve"]] == [256, 512]
    assert len(gail["curve_s"]) == 2
    assert gail["settings"]["learner"]["hidden"] == [16]
    assert retrained["score_of_the_run"] == gail["score"]
    assert retrained["reward"]["distance"] == gail["reward"]["distance"]
    assert names["bc-pointmass-d2-s21"]["reward"] is None
    # finished: nothing runs twice
    n = len(commands)
    bench()
    assert len(commands) == n
    assert "every cell has its result" in capsys.readouterr().err

    Path("README.md").write_text("# A tool\n\n" + "\n".join(marks("small summary")) + "\n")
    written = ("--results", "results", "--into", "RESULTS.md")
    irl("bench", "table", "small.toml", *written, "--write")
    first = Path("RESULTS.md").read_text()
    assert "### `small`: a point on a line\n\n```\nirl bench small\n```" in first
    assert "- anything about tasks with legs" in first
    assert "| gail | bc |" not in first
    assert "| gail | 2 | bc | 2 | PointMass |" in first
    readme = Path("README.md").read_text()
    assert "(results/small/curves.svg)" in readme
    assert "| ppo on gail at 100% | 2 | 256 | PointMass | 1 |" in readme
    drawn = ElementTree.parse("results/small/curves.svg").getroot()
    assert len([e for e in drawn.iter() if e.tag.endswith("polyline")]) == 4
    irl("bench", "table", "small.toml", *written, "--write")
    assert (Path("RESULTS.md").read_text(), Path("README.md").read_text()) == (first, readme)
    Path("small.toml").write_text(GRID.replace("steps = 40", "steps = 60"))
    capsys.readouterr()
    irl("bench", "table", "small.toml", *written)
    said = capsys.readouterr().out
    assert "bc-pointmass-d2-s21.json: steps was 40 and is 60" in said
    assert "| bc |" not in said


def test_a_cell_goes_on_where_it_was_and_what_it_was_not_is_refused(
    bench: Command, commands: list, capsys: pytest.CaptureFixture
) -> None:
    one = ("--only", "gail-pointmass-d2-s22")
    bench(*one)
    result = Path("results/small/gail-pointmass-d2-s22.json")
    before = json.loads(result.read_text())
    result.unlink()
    Path("runs/small/gail-pointmass-d2-s22/evaluation.json").unlink()
    commands.clear()
    bench(*one)
    assert [words[:2] for words in commands] == [("train", "--resume"), ("evaluate", commands[1][1])]
    assert json.loads(result.read_text()) == before
    Path("small.toml").write_text(GRID.replace("steps = 512", "steps = 640"))
    with pytest.raises(SystemExit):
        bench(*one)
    assert "is the result of another cell: steps was 512 and is 640" in capsys.readouterr().err
    result.unlink()
    with pytest.raises(SystemExit):
        bench(*one)
    assert "was begun as another cell: steps was 512 and is 640" in capsys.readouterr().err


def test_a_retraining_on_what_was_learned_otherwise_has_no_result_yet(
    bench: Command, commands: list, capsys: pytest.CaptureFixture
) -> None:
    (cell,) = only(expand(read_grid(Path("small.toml"))), ["ppo"])[1:]
    Path("results/small").mkdir(parents=True)
    result = Path("results/small") / f"{cell.name}.json"
    # written before cells said how their sources learned
    older = {name: value for name, value in to_json(cell).items() if name not in LATER}
    result.write_text(json.dumps({"cell": older}))
    bench("--estimate")
    assert "4 cells to do, 1 done" in " ".join(capsys.readouterr().err.split())
    result.write_text(json.dumps({"cell": to_json(cell)}))
    Path("small.toml").write_text(GRID.replace("steps = 512", "steps = 640"))
    with pytest.raises(SystemExit):
        bench("--estimate")
    assert "is the result of another cell: source_steps was 512 and is 640" in capsys.readouterr().err


def test_an_evaluation_of_half_a_run_is_made_again(
    bench: Command, commands: list, capsys: pytest.CaptureFixture
) -> None:
    one, early = (
        ("--only", "gail-pointmass-d2-s21-ppo"),
        Path("runs/small/gail-pointmass-d2-s21/evaluation.json"),
    )
    bench("--only", "gail-pointmass-d2-s21")
    result = Path("results/small/gail-pointmass-d2-s21.json")
    before = json.loads(result.read_text())
    half = json.loads(early.read_text()) | {"env_steps": 256}
    early.write_text(json.dumps(half))
    Path("results/small/gail-pointmass-d2-s21-ppo-on-100.json").unlink()
    # the run has its result, so nobody evaluates it for the retraining
    with pytest.raises(SystemExit):
        bench(*one)
    assert "evaluation.json is not of the run's last snapshot; make it again: irl evaluate" in (
        capsys.readouterr().err
    )
    result.unlink()
    bench(*one)
    assert json.loads(result.read_text()) == before


def test_a_cell_that_fails_is_reported_and_the_rest_goes_on(
    bench: Command, commands: list, capsys: pytest.CaptureFixture
) -> None:
    Path("small.toml").write_text(
        GRID.replace(f'"{TASK}"', f'"{TASK}", "HumanoidStandup-v5"').split("[[part]]\nkind")[0]
    )
    with pytest.raises(SystemExit) as stop:
        bench("--only", "bc-humanoidstandup-d2-s21", "bc-pointmass-d2-s21")
    assert stop.value.code == 1
    assert [path.stem for path in Path("results/small").glob("*.json")] == ["bc-pointmass-d2-s21"]
    said = capsys.readouterr().err
    assert "irl: bc-humanoidstandup-d2-s21: no expert policy for HumanoidStandup-v5 on the shelf" in said


def test_an_error_that_nobody_foresaw_is_its_cells_alone(
    bench: Command, commands: list, capsys: pytest.CaptureFixture
) -> None:
    bench("--only", "bc-pointmass-d2-s21")
    Path("results/small/bc-pointmass-d2-s21.json").unlink()
    Path("runs/small/bc-pointmass-d2-s21/metrics.jsonl").unlink()
    with pytest.raises(SystemExit) as stop:
        bench("--only", "bc-pointmass")
    assert stop.value.code == 1
    assert [path.stem for path in Path("results/small").glob("*.json")] == ["bc-pointmass-d2-s22"]
    assert "irl: bc-pointmass-d2-s21: IndexError: list index out of range" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ('"schedule.epochs" = 1', '"schedule.epoch" = 1', "gail-pointmass-d2-s21: "),
        ('methods = ["bc"]', 'methods = ["cloning"]', "no method 'cloning'; there are gail"),
    ],
)
def test_what_a_command_would_refuse_is_refused_before_anything_runs(
    bench: Command, commands: list, capsys: pytest.CaptureFixture, before: str, after: str, complaint: str
) -> None:
    assert before in GRID
    Path("small.toml").write_text(GRID.replace(before, after))
    with pytest.raises(SystemExit):
        bench()
    assert complaint in capsys.readouterr().err
    assert commands == []


def test_a_cluster_without_ray_is_said(bench: Command, capsys: pytest.CaptureFixture, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(SystemExit):
        bench("--ray", "local")
    assert "--ray needs Ray, which is not installed: pip install 'irl[ray]'" in capsys.readouterr().err
