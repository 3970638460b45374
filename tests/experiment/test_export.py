"""`irl export`: what it writes is read by Stable-Baselines3 itself, and acts as the policy does."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3 import PPO, SAC

from irl.core.records import open_run
from irl.experiment.cli import main
from irl.policies.policy import load_policy, save_policy
from tests import pointmass
from tests.experiment.conftest import DATASET, QUICK, TASK

Command = Callable[..., None]

WATCH = ["--watch.no-progress", "--watch.no-tensorboard", "--watch.eval-episodes=0"]
SAC_WORDS = ["--learner.steps-per-round=100", "--learner.learning-starts=100", "--learner.hidden=16"]
DAC = ["--steps=300", "--learner.batch-size=32", "--discriminator.hidden=16", *SAC_WORDS]


@pytest.fixture(scope="session")
def trained(home: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run of GAIL and one of DAC, which knows the absorbing state."""
    folder = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MINARI_DATASETS_PATH", str(home / "datasets"))
        patch.chdir(folder)
        main(["train", "gail", "--env-id", TASK, "--out", "gail", *QUICK, *WATCH])
        main(["train", "dac", "--env-id", "Cliff-v0", "--demos", DATASET, "--out", "dac", *DAC, *WATCH])
    return folder


@pytest.fixture(autouse=True)
def runs(trained: Path, irl: Command) -> None:
    """Copies of those runs where the test is."""
    for name in ("gail", "dac"):
        shutil.copytree(trained / name, name)


def same_actions(run: Path, step: int, model: PPO | SAC) -> None:
    ours = load_policy(open_run(run).snapshots()[step] / "policy.safetensors")
    obs = np.random.default_rng(0).uniform(-1.5, 1.5, (100, 2))
    predicted, _ = model.predict(obs, deterministic=True)
    np.testing.assert_allclose(predicted, [ours(row) for row in obs], atol=1e-5)


@pytest.mark.parametrize(("run", "env_id", "kind"), [("gail", TASK, PPO), ("dac", "Cliff-v0", SAC)])
def test_the_zip_of_a_run_acts_as_its_policy(
    irl: Command, run: str, env_id: str, kind: type[PPO] | type[SAC], capsys: pytest.CaptureFixture
) -> None:
    irl("export", run, "--format", "sb3", "--out", "new/policy.zip")
    said = capsys.readouterr().out
    assert "new/policy.zip" in said
    assert kind.__name__ in said
    assert "untrained" in said
    env = gym.make(env_id)
    # the environment of the task is accepted: its spaces are those in the zip
    same_actions(Path(run), max(open_run(Path(run)).snapshots()), kind.load("new/policy.zip", env=env))
    env.close()
    irl("export", run, "--snapshot", "0")
    same_actions(Path(run), 0, kind.load(Path(run) / "sb3-000000000.zip"))


def test_it_is_read_where_nothing_of_irl_was_imported_before(irl: Command) -> None:
    irl("export", "gail", "--out", "policy.zip")
    program = "from stable_baselines3 import PPO; import numpy; m = PPO.load('policy.zip', device='cpu'); "
    program += "print(m.predict(numpy.zeros(2), deterministic=True)[0].shape)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "(2,)", done.stderr


def test_a_policy_of_the_shelf_and_a_run_of_another_kind(irl: Command, home: Path) -> None:
    words = ["--ppo.n-envs=2", "--ppo.steps-per-round=128", "--ppo.batch-size=64", "--ppo.hidden=16"]
    irl("retrain", "gail", "--steps", "128", "--out", "again", *words, *WATCH)
    irl("export", "again", "--out", "again.zip")
    same_actions(Path("again"), 128, PPO.load("again.zip"))
    irl("export", home / "policies/pointmass/expert", "--out", "expert.zip")
    obs = np.array([0.1, -0.05])
    predicted, _ = PPO.load("expert.zip").predict(obs, deterministic=True)
    np.testing.assert_allclose(predicted, pointmass.expert()(obs), atol=1e-5)


def test_a_file_that_is_there_is_kept_unless_it_is_said(irl: Command, capfd: pytest.CaptureFixture) -> None:
    Path("mine.zip").write_text("mine")
    with pytest.raises(SystemExit):
        irl("export", "gail", "--out", "mine.zip")
    assert "--overwrite" in capfd.readouterr().err
    assert Path("mine.zip").read_text() == "mine"
    irl("export", "gail", "--out", "mine.zip", "--overwrite")
    same_actions(Path("gail"), 768, PPO.load("mine.zip"))


def test_a_write_that_fails_leaves_what_was_there(
    irl: Command, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    Path("mine.zip").write_text("mine")
    before = sorted(Path().rglob("*"))

    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("irl.core.files.os.fsync", full)
        with pytest.raises(SystemExit):
            irl("export", "gail", "--out", "mine.zip", "--overwrite")
    assert "mine.zip: No space left" in capfd.readouterr().err
    assert Path("mine.zip").read_text() == "mine"
    assert sorted(Path().rglob("*")) == before


def of_another_task() -> None:
    place = Path("gail/snapshots/000000768/policy.safetensors")
    ours = load_policy(place)
    weights = ours.weights | {"action_high": np.full(2, 3.0)}
    save_policy(type(ours)(ours.spec, weights), place)


MISTAKES = {
    "a run that is not there": ("export nowhere", ["nowhere", "config.json"]),
    "a snapshot that is not there": ("export gail --snapshot 5", ["5", "768", "--snapshot"]),
    "a format that is none": ("export gail --format onnx", ["onnx", "sb3"]),
    "a file that is a folder": ("export gail --out dac --overwrite", ["dac", "--out"]),
    "a shelf's policy without a place": ("export shelved", ["shelved", "--out"]),
    "a shelf's policy at a step": ("export shelved --snapshot 3 --out x.zip", ["shelved", "--snapshot"]),
    "a policy that is damaged": ("export damaged --out x.zip", ["damaged", "not a policy"]),
    "other bounds than the task's": ("export gail --out x.zip", ["action_high", "snapshots/000000768"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_and_leaves_nothing(
    mistake: str, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    for name in ("shelved", "damaged"):
        Path(name).mkdir()
    save_policy(pointmass.expert(), Path("shelved/policy.safetensors"))
    Path("damaged/policy.safetensors").write_text("no policy")
    if mistake.startswith("other bounds"):
        of_another_task()
    words, expected = MISTAKES[mistake]
    before = sorted(Path().rglob("*"))
    with pytest.raises(SystemExit) as stopped:
        irl(*words.split())
    said = capfd.readouterr()
    assert stopped.value.code == 2
    assert said.err.count("\n") == 1, said.err
    assert [word for word in expected if word not in said.err] == [], said.err
    assert sorted(Path().rglob("*")) == before
