"""`irl experts`: a policy is trained, measured, shelved, listed, and measured again."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import pytest

from irl.core import files
from irl.experiment import recipes
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig
from irl.policies import shelf
from tests.policies.test_card import FIXED

Command = Callable[..., None]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Recipes that take a second."""
    ppo = PPOConfig(n_envs=2, steps_per_round=128, batch_size=64, n_epochs=1, hidden=(8,))
    sac = SACConfig(steps_per_round=100, learning_starts=100, batch_size=16, hidden=(8,))
    rows = {"ppo": recipes.Recipe(256, ppo), "sac": recipes.Recipe(200, replace(sac, average=0.5))}
    monkeypatch.setattr(recipes, "DEFAULTS", rows)


@pytest.mark.parametrize("algo", ["ppo", "sac"])
def test_an_expert_is_trained_measured_and_shelved(irl: Command, algo: str) -> None:
    words = ("--env-id", "Cliff-v0", "--algo", algo, "--policies-root", "shelf", "--watch.no-progress")
    irl("experts", "train", *words)
    card = files.read_json(Path("shelf/cliff/expert/card.json"))
    assert set(card) >= FIXED
    assert (card["env_id"], card["algorithm"], card["episodes"]) == ("Cliff-v0", algo, 20)
    assert len(card["episode_seeds"]) == len(set(card["episode_seeds"])) == 20
    assert card["train_s"] == files.read_json(next(Path("runs").glob("*/policy/card.json")))["train_s"] > 0
    found = shelf.find("Cliff-v0", root=Path("shelf"))
    assert found.card.measured.return_mean == card["return_mean"]


def test_the_shelf_is_listed_and_measured_again_to_the_same_numbers(
    irl: Command, capsys: pytest.CaptureFixture
) -> None:
    rows = []
    for words in (("list", "--markdown"), ("evaluate", "--env-id", "PointMass-v0", "--markdown")):
        irl("experts", *words)
        printed = capsys.readouterr().out.splitlines()
        (row,) = [[cell.strip() for cell in line.split("|")] for line in printed if "PointMass-v0" in line]
        rows.append(row)
    listed, measured = rows
    # but for the minutes and the file's size, which are of the machine
    assert listed[1:5] == measured[1:5] == ["PointMass-v0", "expert", "by hand", "0M"]
    assert listed[6:10] == measured[6:10]
    assert "±" in listed[6]


def test_all_of_the_shelf_is_measured_into_one_table(irl: Command, capsys: pytest.CaptureFixture) -> None:
    irl("experts", "list", "--markdown")
    listed = capsys.readouterr().out
    irl("experts", "evaluate", "--all", "--level", "expert", "--workers", 1, "--episodes", 1, "--markdown")
    measured = capsys.readouterr().out
    names = "task level made by steps trained return min length random size"
    for printed in (listed, measured):
        head, _, *rows = [line for line in printed.splitlines() if line.startswith("|")]
        assert " ".join(head.replace("|", " ").split()) == names
        (row,) = [[cell.strip() for cell in line.split("|")] for line in rows if "PointMass-v0" in line]
        assert row[2:5] == ["expert", "by hand", "0M"]
        assert row[-2].endswith(" kB")
        assert "Hopper-v5" in printed


def test_what_is_on_the_shelf_is_not_replaced_unasked(irl: Command, capsys: pytest.CaptureFixture) -> None:
    words = ["experts", "train", "--env-id", "Cliff-v0", "--policies-root", "shelf", "--watch.no-progress"]
    irl(*words)
    first = Path("shelf/cliff/expert/policy.safetensors").read_bytes()
    irl(*words, "--seed", "1")
    assert "kept" in capsys.readouterr().out
    assert Path("shelf/cliff/expert/policy.safetensors").read_bytes() == first
    irl(*words, "--seed", "2", "--overwrite")
    assert Path("shelf/cliff/expert/policy.safetensors").read_bytes() != first


@pytest.mark.parametrize("more", [(), ("--overwrite",)], ids=["", "overwrite"])
def test_another_version_of_the_task_does_not_come_in_its_place(
    irl: Command, capfd: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch, more: tuple[str, ...]
) -> None:
    spec = replace(gym.spec("Cliff-v0"), id="Cliff-v1")
    monkeypatch.setitem(gym.registry, "Cliff-v1", spec)
    words = ("--policies-root", "shelf", "--watch.no-progress")
    irl("experts", "train", "--env-id", "Cliff-v0", *words)
    first = Path("shelf/cliff/expert/policy.safetensors").read_bytes()
    with pytest.raises(SystemExit):
        irl("experts", "train", "--env-id", "Cliff-v1", "--out", "other", *words, *more)
    said = capfd.readouterr().err.splitlines()[-1]
    assert "shelf/cliff/expert holds the policy of Cliff-v0, and one of Cliff-v1" in said
    assert "--policies-root" in said
    assert not Path("other").exists()
    assert Path("shelf/cliff/expert/policy.safetensors").read_bytes() == first


def test_the_same_command_again_goes_on_and_ends_the_same(irl: Command) -> None:
    words = ["experts", "train", "--env-id", "Cliff-v0", "--policies-root", "shelf", "--watch.no-progress"]
    irl(*words, "--out", "run")
    first = Path("run/policy/policy.safetensors").read_bytes()
    irl(*words, "--out", "run")
    assert Path("run/policy/policy.safetensors").read_bytes() == first


def test_other_settings_do_not_go_on_in_a_run_of_these(irl: Command, capfd: pytest.CaptureFixture) -> None:
    words = ["experts", "train", "--env-id", "Cliff-v0", "--policies-root", "shelf", "--watch.no-progress"]
    irl(*words, "--out", "run")
    with pytest.raises(SystemExit):
        irl(*words, "--out", "run", "--seed", "5")
    assert "seed" in capfd.readouterr().err.splitlines()[-1]
