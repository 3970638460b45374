"""Nothing is lost: runs that are killed, shared, diverging, or resumed with other settings."""

import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from irl.core import files, records
from irl.core.errors import UserError
from irl.experiment import recipes
from irl.experiment.cli import main
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig
from tests.experiment.conftest import QUICK, TASK
from tests.experiment.test_train_airl import PPO
from tests.experiment.test_train_dac import SMALL

Command = Callable[..., None]
Train = Callable[..., Path]

GAIL = ("train", "gail", "--env-id", TASK, *QUICK, "--watch.checkpoint-every-s=0")
AIRL = ("train", "airl", "--env-id", TASK, *PPO, "--watch.checkpoint-every-s=0")
RESUME = ("train", "--resume")
DAC = ("train", "dac", "--env-id", TASK, *SMALL, "--watch.checkpoint-every-s=0")
SAC = (
    *("experts", "train", "--env-id", TASK, "--algo", "sac", "--steps", "900", "--policies-root", "shelf"),
    *("--watch.no-progress", "--watch.checkpoint-every-s=0", "--watch.eval-episodes=2"),
)


@pytest.fixture(autouse=True)
def small_recipes(monkeypatch: pytest.MonkeyPatch) -> None:
    """What `irl experts train` does for minutes, in a second."""
    sac = SACConfig(
        n_envs=2, steps_per_round=100, learning_starts=150, updates_per_step=0.5, batch_size=32, hidden=(16,)
    )
    ppo = PPOConfig(n_envs=2, steps_per_round=256, batch_size=64, n_epochs=2, hidden=(16,))
    for env_id in (TASK, "NaNLater-v0", "Cliff-v0"):
        monkeypatch.setitem(recipes.RECIPES, (env_id, "sac"), recipes.Recipe(3000, sac))
        monkeypatch.setitem(recipes.RECIPES, (env_id, "ppo"), recipes.Recipe(3000, ppo))


def in_a_process(words: tuple[str, ...], run: Path, kill_at: int | None = None) -> bool:
    """Run the command in a forked process; whether it came to its end.

    It is killed in the round after `run` has so many lines of metrics, wherever it is then.
    """
    if (child := os.fork()) == 0:
        try:
            main(words)
            os._exit(0)
        except BaseException:
            os._exit(1)
    metrics, deadline = run / "metrics.jsonl", time.monotonic() + 300.0
    while time.monotonic() < deadline:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            assert status == 0
            return True
        if kill_at is not None and metrics.is_file() and metrics.read_bytes().count(b"\n") >= kill_at:
            break
        time.sleep(0.001)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    assert time.monotonic() < deadline, "it did not end"
    return False


def ends(run: Path) -> tuple[list[bytes], list[dict]]:
    """The last policy and reward, and the metrics without the clock's."""
    last = sorted((run / "snapshots").iterdir())[-1]
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    clock = ("wall_s", "checkpoint_s")
    weights = [path.read_bytes() for path in sorted(last.rglob("*.safetensors"))]
    return weights, [{name: value for name, value in row.items() if name not in clock} for row in rows]


@pytest.mark.parametrize(
    ("start", "resume"),
    [
        (GAIL, RESUME),
        (AIRL, RESUME),
        (DAC, RESUME),
        (SAC, ("experts", "train", "--policies-root", "shelf", "--resume")),
    ],
    ids=["gail", "airl", "dac", "sac expert"],
)
def test_killed_twice_it_ends_as_if_it_had_not_been(
    start: tuple[str, ...], resume: tuple[str, ...], irl: Command
) -> None:
    assert in_a_process((*start, "--out", "straight"), Path("straight"))
    killed = Path("killed")
    assert not in_a_process((*start, "--out", "killed"), killed, kill_at=2)
    assert not in_a_process((*resume, "killed"), killed, kill_at=4)
    assert in_a_process((*resume, "killed"), killed)
    assert ends(killed) == ends(Path("straight"))


def test_a_run_in_use_is_left_alone(train: Train, irl: Command, capfd: pytest.CaptureFixture) -> None:
    run = train("run")
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    with records.open_run(run).locked(), pytest.raises(SystemExit) as stopped:
        irl("train", "--resume", run)
    assert stopped.value.code == 2
    assert f"run is in use by process {os.getpid()}" in capfd.readouterr().err
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before
    irl("train", "--resume", run)


@pytest.mark.parametrize("algo", ["ppo", "sac"])
def test_nan_stops_the_training_and_keeps_the_last_good_checkpoint(
    algo: str, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    words = ("--env-id", "NaNLater-v0", "--algo", algo, "--out", "run", "--policies-root", "shelf")
    with pytest.raises(SystemExit) as stopped:
        irl("experts", "train", *words, "--watch.checkpoint-every-s=0", "--watch.no-progress")
    assert stopped.value.code == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    run = records.open_run(Path("run"))
    kept = max(run.checkpoints())
    assert f"irl: training stopped in round {len(run.metrics()) + 1}: reward of" in said
    assert f"the checkpoint of step {kept:,} is good" in said
    content, damaged = run.load_checkpoint()
    assert content is not None
    assert damaged == []
    assert "NaN" not in (run.path / "metrics.jsonl").read_text()
    assert not Path("shelf").exists()


def test_weights_that_overflow_are_named(irl: Command, capfd: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as stopped:
        irl("train", "gail", "--env-id", TASK, "--out", "run", *QUICK, "--learner.lr=1e30")
    assert stopped.value.code == 2
    said = capfd.readouterr().err
    assert "training stopped in round 1: policy" in said
    assert "no checkpoint yet" in said


def test_other_settings_than_it_was_begun_with_are_refused_and_shown(
    train: Train, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    run = train("run")
    config = files.read_json(run / "config.json")
    config["learner"]["lr"], config["watch"]["eval_every"] = 0.5, 7
    files.write_json(run / "config.json", config)
    with pytest.raises(SystemExit):
        irl("train", "--resume", run)
    said = capfd.readouterr().err.splitlines()[-1]
    assert "learner.lr was 0.0006 and is 0.5" in said
    assert "eval_every" not in said


def test_an_expert_goes_on_by_its_run_alone(irl: Command, capfd: pytest.CaptureFixture) -> None:
    words = ["experts", "train", "--policies-root", "shelf"]
    irl(*words, "--env-id", "Cliff-v0", "--steps=1000", "--out=run", "--watch.no-progress")
    policy = Path("run/policy/policy.safetensors").read_bytes()
    irl(*words, "--resume", "run")
    assert Path("run/policy/policy.safetensors").read_bytes() == policy
    for refused, hint in (
        (("experts", "train", "--resume", "run", "--steps", "5"), "leave the others away"),
        (("train", "--resume", "run"), "irl experts train --resume run"),
        (("experts", "train"), "--env-id"),
        ((*words, "--env-id=Cliff-v0", "--steps=4000", "--out=run"), "steps was 1000 and is 4000"),
    ):
        with pytest.raises(SystemExit):
            irl(*refused)
        assert hint in capfd.readouterr().err.splitlines()[-1]


def test_a_used_folder_says_how_to_go_on(train: Train, irl: Command) -> None:
    run = train("run")
    with pytest.raises(UserError, match="irl train --resume run"):
        records.create(run, {}, {})
