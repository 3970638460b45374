"""A user's mistake: one line on stderr that says what to type, exit status 2, nothing left behind."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from irl.experiment.cli import COMMANDS, main
from tests.experiment.conftest import QUICK, TASK

Command = Callable[..., None]

MISTAKES = {
    "unknown environment": ("train gail --env-id Hoper-v5 --out run", ["Hoper-v5", "Hopper-v5"]),
    "unknown environment for demonstrations": ("demos generate --env-id HalfCheeta-v5", ["HalfCheetah-v5"]),
    "no expert for the task": (
        "demos generate --env-id Cliff-v0",
        ["Cliff-v0", "irl experts train --env-id Cliff-v0"],
    ),
    "no such dataset": (
        f"train gail --env-id {TASK} --demos irl/pointmass/medium-v0 --out run",
        ["irl/pointmass/medium-v0", "irl/pointmass/expert-v0", "irl demos generate"],
    ),
    "demonstrations of another task": (
        "train gail --env-id Hopper-v5 --demos irl/pointmass/expert-v0 --out run",
        ["observations of 2", "actions of 2", "11", "3"],
    ),
    "more episodes than there are": (
        f"train gail --env-id {TASK} --demo-episodes 7 --out run",
        ["7", "6"],
    ),
    "a used output folder": (f"train gail --env-id {TASK} --out used", ["used", "--out"]),
    "no episodes": (f"demos generate --env-id {TASK} --episodes 0", ["episodes", "0"]),
    "no passes": (f"train gail --env-id {TASK} --schedule.epochs 0 --out run", ["epochs", "0"]),
    "no environments": (f"train gail --env-id {TASK} --learner.n-envs 0 --out run", ["n_envs", "0"]),
    "a negative seed": (f"train gail --env-id {TASK} --seed -1 --out run", ["seed", "-1"]),
    "a seed too large": (f"train gail --env-id {TASK} --seed 4294967296 --out run", ["seed", "4294967295"]),
    "an expert for no steps": (f"experts train --env-id {TASK} --steps 0", ["steps", "0"]),
    "an expert measured never": (f"experts evaluate --env-id {TASK} --episodes 0", ["episodes", "0"]),
    "a level that is not there": (
        f"experts evaluate --env-id {TASK} --level medium",
        ["medium", "irl experts train"],
    ),
    "a bound without end": (
        f"train gail --env-id {TASK} --learner.max-grad-norm inf --out run",
        ["--learner.max-grad-norm is inf; expected a finite number"],
    ),
    "a rate that is no number": (
        f"train gail --env-id {TASK} --learner.lr nan --out run",
        ["--learner.lr is nan; expected a finite number"],
    ),
    "a least return of nothing": (
        f"demos generate --env-id {TASK} --min-return=-inf",
        ["--min-return is -inf; expected a finite number"],
    ),
    "no steps": (f"train gail --env-id {TASK} --steps 0 --out run", ["steps", "0"]),
    "settings that contradict": (
        f"train gail --env-id {TASK} --learner.n-envs 3 --out run",
        ["steps_per_round", "2048", "3"],
    ),
    "an option that does not exist": (f"train gail --env-id {TASK} --sped 3", ["--sped", "--help"]),
    "a number that is none": (f"train gail --env-id {TASK} --steps many", ["many", "int"]),
    "a run that is not there": ("evaluate nowhere", ["nowhere", "config.json"]),
    "resuming what is no run": ("train --resume nowhere", ["nowhere"]),
    "a config that is not there": ("train --config nowhere.json --out run", ["nowhere.json"]),
    "AIRL with TD3": (f"train airl-td3 --env-id {TASK}", ["no log pi", "irl train airl-sac"]),
    "train without a method": ("train", ["irl train gail", "--resume"]),
    "an unknown command": ("imitate gail", ["imitate", "train gail"]),
    "an unknown dataset to show": ("demos show irl/hopper/nothing-v0", ["irl/hopper/nothing-v0"]),
    "neither a task nor all": ("demos generate --episodes 1", ["--env-id", "--all"]),
    "a task and all": (f"demos generate --env-id {TASK} --all", ["--env-id", "--all"]),
    "all under one name": ("demos generate --all --dataset-id irl/a-v0", ["--all", "--dataset-id"]),
    "all of a level that is not there": ("demos generate --all --level nothing", ["irl experts train"]),
    "seeds that run backwards": (f"demos generate --env-id {TASK} --seed-range 5 3", ["seed_range", "5 3"]),
    "more seeds than episodes": (
        f"demos generate --env-id {TASK} --seed-range 0 9 --episodes 5",
        ["10 seeds", "5 episodes"],
    ),
    "noise below nothing": (f"demos generate --env-id {TASK} --action-noise -1", ["noise", "-1"]),
    "more than always random": (f"demos generate --env-id {TASK} --random-actions 1.5", ["0 to 1", "1.5"]),
    "no step to learn from": (f"demos generate --env-id {TASK} --subsampling-rate 0", ["subsampling_rate"]),
    "a function without a distribution": (
        f"demos generate --env-id {TASK} --policy tests.pointmass:demonstrations --stochastic",
        ["no distribution", "--stochastic"],
    ),
    "a function in several processes": (
        f"demos generate --env-id {TASK} --policy a:b --workers 2",
        ["--workers", "--policy"],
    ),
    "a level of the shelf beside another policy": (
        f"demos generate --env-id {TASK} --policy a:b --level medium",
        ["--level", "--policy"],
    ),
    "one expert and all": (f"experts evaluate --env-id {TASK} --all", ["--all", "--env-id"]),
    "a dataset that is there already": (f"demos generate --env-id {TASK}", ["overwrite"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_and_leaves_nothing(
    mistake: str, irl: Command, tmp_path: Path, capfd: pytest.CaptureFixture
) -> None:
    words, expected = MISTAKES[mistake]
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "notes.txt").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(SystemExit) as stopped:
        irl(*words.split())
    said = capfd.readouterr()
    assert stopped.value.code == 2
    assert said.err.count("\n") == 1
    assert said.err.startswith("irl: ")
    assert not [word for word in expected if word not in said.err]
    assert sorted(tmp_path.rglob("*")) == before


def test_debug_shows_the_traceback(irl: Command) -> None:
    with pytest.raises(ValueError, match="nowhere"):
        irl("evaluate", "nowhere", "--debug")


def test_a_second_run_into_a_folder_is_refused_and_the_first_is_untouched(irl: Command) -> None:
    irl("train", "gail", "--env-id", TASK, "--out", "run", *QUICK)
    before = {path: path.read_bytes() for path in Path("run").rglob("*") if path.is_file()}
    with pytest.raises(SystemExit):
        irl("train", "gail", "--env-id", TASK, "--out", "run", *QUICK)
    assert {path: path.read_bytes() for path in Path("run").rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("name", [" ".join(name) for name in COMMANDS])
def test_every_command_explains_itself(name: str, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as stopped:
        main([*name.split(), "--help"])
    assert stopped.value.code == 0
    assert f"irl {name}" in capsys.readouterr().out


def test_without_words_every_command_is_listed(capsys: pytest.CaptureFixture) -> None:
    main([])
    listed = capsys.readouterr().out
    assert all(f"irl {' '.join(name)}" in listed for name in COMMANDS)


@pytest.mark.parametrize("words", [("demos", "--help"), ("experts", "-h"), ("demos",), ("--help",)])
def test_words_that_begin_commands_list_those(words: tuple[str, ...], capsys: pytest.CaptureFixture) -> None:
    main(words)
    listed = capsys.readouterr().out
    begun = tuple(word for word in words if not word.startswith("-"))
    assert all((f"irl {' '.join(name)} " in listed) == (name[: len(begun)] == begun) for name in COMMANDS)


def test_the_program_as_installed_exits_with_2_and_one_line(tmp_path: Path) -> None:
    program = "from irl.experiment.cli import main; main()"
    words = [sys.executable, "-c", program, "evaluate", "nowhere"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n"), done.stdout) == (2, 1, "")
