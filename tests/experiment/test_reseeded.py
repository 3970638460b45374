"""Several seeds of a retraining: each fresh, none done twice, and gathered beside the run."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from irl.core import files
from irl.core.errors import UserError
from irl.core.statistics import iqm
from irl.experiment import reseeded
from irl.experiment.configs import GAILRun
from irl.experiment.retrain import Retrain, retrain_one, settled
from tests.experiment.conftest import TASK
from tests.experiment.test_retrain import PPO, equal, policies, runs, trained

__all__ = ["runs", "trained"]

Command = Callable[..., None]
SHORT = [*PPO, "--steps=256", "--ppo.n-epochs=1", "--watch.eval-every=1"]


def rows() -> list[dict]:
    return files.read_json(Path("gail/retrained.json"))["rows"]


@pytest.mark.usefixtures("runs")
def test_seeds_are_gathered_and_later_ones_are_added(irl: Command, capsys: pytest.CaptureFixture) -> None:
    irl("retrain", "gail", "--seeds", "7", "8", "--out", "again", *SHORT)
    said = capsys.readouterr().out
    folders = sorted(Path("again").iterdir())
    assert [folder.name for folder in folders] == [f"retrain-gail-768-ppo-s{seed}" for seed in (7, 8)]
    assert not equal(policies(folders[0])[0], policies(folders[1])[0])
    assert not equal(policies("gail")[0], policies(folders[0])[0])
    results = [files.read_json(folder / "retrain.json") for folder in folders]
    (row,) = rows()
    assert (row["snapshot"], row["part"], row["dynamics"]) == (768, "gail", "as trained")
    assert row["seeds"] == [7, 8]
    assert row["returns"] == pytest.approx([result["true"]["return_mean"] for result in results])
    assert row["scores"] == pytest.approx([result["true"]["normalised_score"] for result in results])
    above = [value - row["random"] for value in (iqm(np.array(row["returns"])), row["beside"])]
    if row["ratio"]["value"] is not None:
        assert row["ratio"]["value"] == pytest.approx(above[0] / above[1])
        assert row["ratio"]["low"] <= row["ratio"]["value"] <= row["ratio"]["high"]
    else:
        assert "nothing to be a ratio to" in row["ratio_reason"]
    assert "of seeds 7 8" in said
    before = {path: path.stat().st_mtime_ns for path in Path("again").rglob("*")}
    irl("retrain", "gail", "--seeds", "8", "9", "--out", "again", *SHORT)
    (row,) = rows()
    assert row["seeds"] == [7, 8, 9]
    done = Path("again/retrain-gail-768-ppo-s8/retrain.json")
    assert done.stat().st_mtime_ns == before[done]


@pytest.mark.usefixtures("runs")
def test_a_row_that_another_command_wrote_meanwhile_stays(
    irl: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    irl("retrain", "gail", "--seeds", "7", "--out", "again", *SHORT)
    content = files.read_json(Path("gail/retrained.json"))
    other = content["rows"][0] | {"part": "another", "seeds": [3]}

    def meanwhile(command: Retrain) -> None:
        retrain_one(command)
        files.write_json(Path("gail/retrained.json"), content | {"rows": [*content["rows"], other]})

    monkeypatch.setattr(reseeded, "retrain_one", meanwhile)
    irl("retrain", "gail", "--seeds", "8", "--out", "again", *SHORT)
    assert [(row["part"], row["seeds"]) for row in rows()] == [("another", [3]), ("gail", [7, 8])]


@pytest.mark.usefixtures("runs")
def test_another_task_is_another_row_and_the_proxy_is_followed(irl: Command) -> None:
    irl("retrain", "gail", "--seeds", "7", *SHORT)
    irl("retrain", "gail", "--seeds", "7", "--env-kwargs", "cliff=1.2", *SHORT)
    here, there = rows()
    assert (here["dynamics"], there["dynamics"]) == ("as trained", "cliff=1.2")
    assert there["env_id"] == f'{TASK}?{{"cliff":1.2}}'
    # no expert is known there
    assert there["scores"] == [None]
    assert here["ratio"]["low"] is None
    points = files.read_json(Path("runs/retrain-gail-768-ppo-s7/retrain.json"))["proxy_gold"]["points"]
    assert [point["step"] for point in points] == [0, 128, 256]


@pytest.mark.usefixtures("runs")
def test_another_learner_is_another_row_and_says_so(irl: Command, capsys: pytest.CaptureFixture) -> None:
    irl("retrain", "gail", "--seeds", "7", *SHORT)
    (before,) = rows()
    irl("retrain", "gail", "--seeds", "8", "--ppo.lr=0.001", "--entropy=0.5", "--out", "other", *SHORT)
    kept, other = rows()
    assert kept == before
    assert (kept["seeds"], other["seeds"]) == ([7], [8])
    assert other["settings"]["lr"] == 0.001
    assert "lr 0.001" in other["changed"]
    assert "entropy 0.5" in capsys.readouterr().out
    # one of before there were settings in a row
    del kept["settings"]
    files.write_json(Path("gail/retrained.json"), {"format": "irl.retrained", "version": 1, "rows": [kept]})
    irl("retrain", "gail", "--seeds", "7", *SHORT)
    old, new = rows()
    assert old == kept
    assert new == before


@pytest.mark.usefixtures("runs")
def test_what_another_reward_taught_is_not_taken_for_this_ones(
    irl: Command, capsys: pytest.CaptureFixture
) -> None:
    shutil.copytree("gail", "other/gail")
    irl("retrain", "gail", "--seeds", "7", "--out", "again", *SHORT)
    first, *_, last = sorted(Path("other/gail/snapshots").iterdir())
    shutil.copytree(first / "reward", last / "reward", dirs_exist_ok=True)
    for _ in ("done", "cut short"):
        with pytest.raises(SystemExit) as stop:
            irl("retrain", "other/gail", "--seeds", "7", "--out", "again", *SHORT)
        assert stop.value.code == 2
        assert "again/retrain-gail-768-ppo-s7 is of another reward" in capsys.readouterr().err
        Path("again/retrain-gail-768-ppo-s7/retrain.json").unlink(missing_ok=True)
    assert not Path("other/gail/retrained.json").exists()


def test_retrainings_of_one_of_several_seeds_have_its_methods_name() -> None:
    its = replace(GAILRun("Hopper-v5", seed=0).resolved(), steps=10)
    names = [settled(Retrain(Path(of) / "s0"), its, 10).out.name for of in ("dac-hopper", "gail-sac-hopper")]
    assert names == ["retrain-dac-hopper-s0-10-ppo-s1000", "retrain-gail-sac-hopper-s0-10-ppo-s1000"]


def test_the_dynamics_are_part_of_the_tasks_name() -> None:
    its = replace(GAILRun("Hopper-v5", seed=3).resolved(), steps=10)
    config = settled(Retrain(Path("r"), dynamics=("gravity=0.5", "mass=2")), its, 10)
    assert config.env_id == 'Hopper-v5?{"dynamics":{"gravity":0.5,"mass":2}}'
    assert config.out.name.startswith("retrain-r-10-hopper-")
    assert config.seed == 1003
    with pytest.raises(UserError, match="seed 3 is the run's own"):
        settled(Retrain(Path("r"), seed=3), its, 10)


MISTAKES = {
    "retrain gail --seeds 7 7": "names one twice",
    "retrain gail --seeds 7 --seed 8": "leave --seed and --resume away",
    "retrain gail --seeds 1 0": "seed 0 is the run's own",
    "retrain gail --seeds 7 --dynamics mass=2": "no MuJoCo task",
    "retrain gail --seeds 7 --dynamics mass": "is no argument",
    "retrain dac --seeds 7": "not a file that irl retrain --seeds writes",
    "retrain nan --seeds 7 --out other --steps 9": "steps was 256 and is 9",
}


@pytest.mark.usefixtures("runs")
def test_a_mistake_is_one_line_and_trains_nothing(irl: Command, capsys: pytest.CaptureFixture) -> None:
    Path("dac/retrained.json").write_text('{"format": "irl.retrained", "version": 1, "rows": [{}]}')
    irl("retrain", "nan", "--seeds", "7", "--out", "other", *SHORT)
    before = sorted(Path().rglob("*"))
    for words, said in MISTAKES.items():
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            irl(*words.split())
        assert stop.value.code == 2
        line = capsys.readouterr().err
        assert said in line, line
        assert line.count("\n") == 1
    assert sorted(Path().rglob("*")) == before
