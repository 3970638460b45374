"""`irl train` end to end on a small task: the run folder, resuming, and that watching changes nothing."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from irl.core import files
from irl.core.records import open_run
from irl.demos.generate import generate
from irl.experiment import play
from irl.policies.policy import load_policy
from irl.rewards.artefact import load_reward
from tests import pointmass
from tests.experiment.conftest import DATASET, QUICK, TASK

Train = Callable[..., Path]
Command = Callable[..., None]


def final_weights(run: Path) -> dict[str, np.ndarray]:
    last = list(open_run(run).snapshots().values())[-1]
    reward = {name: value.numpy() for name, value in load_reward(last).net.state_dict().items()}
    return {**load_policy(last / "policy.safetensors").weights, **reward}


def equal(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


TIMES = ("wall_s", "checkpoint_s")


def timeless(run: Path) -> list[dict]:
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    return [{name: value for name, value in row.items() if name not in TIMES} for row in rows]


def test_a_run_folder_explains_itself(train: Train) -> None:
    run = train("run")
    config = files.read_json(run / "config.json")
    assert (config["kind"], config["env_id"], config["learner"]["kind"]) == ("gail", TASK, "ppo")
    assert config["demos"] == "irl/pointmass/expert-v0"
    environment = files.read_json(run / "environment.json")
    assert {"packages", "device", "threads", "git_commit", "git_dirty", "command"} <= set(environment)
    drawn = files.read_json(run / "demonstrations.json")
    assert sorted(drawn["episodes"] + drawn["held_out"]) == list(range(6))
    assert len(drawn["episodes"]) == 4
    assert list(open_run(run).snapshots()) == [0, 128, 256, 384, 640, 768]
    assert any((run / "tensorboard").iterdir())
    rows = open_run(run).metrics()
    assert [row["round"] for row in rows] == [1, 2, 3, 4, 5, 6]
    assert [row["env_steps"] for row in rows] == [128 * i for i in range(1, 7)]
    assert {"round", "env_steps", "wall_s", "return_mean"} <= set(rows[0])
    assert ["eval_return_mean" in row for row in rows] == [False, True] * 3


def test_the_same_seed_gives_the_same_run_and_another_seed_another_one(train: Train) -> None:
    runs = [train("a"), train("b"), train("c", "--seed", "1")]
    assert equal(final_weights(runs[0]), final_weights(runs[1]))
    assert timeless(runs[0]) == timeless(runs[1])
    assert not equal(final_weights(runs[0]), final_weights(runs[2]))


def test_watching_changes_no_weight(train: Train) -> None:
    watched = train("watched", "--watch.checkpoint-every-s", "0")
    quiet = train("quiet", "--watch.eval-episodes", "0", "--watch.no-tensorboard")
    assert equal(final_weights(watched), final_weights(quiet))


def test_the_tasks_own_reward_replaced_by_nan_changes_no_weight_of_policy_or_discriminator(
    irl: Command,
) -> None:
    for env_id in (TASK, "NaNReward-v0"):
        irl("train", "gail", "--env-id", env_id, "--demos", DATASET, "--out", env_id, *QUICK)
    assert equal(final_weights(Path(TASK)), final_weights(Path("NaNReward-v0")))


def test_the_demonstrations_a_run_was_begun_with_are_the_ones_it_goes_on_with(
    train: Train, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    train("run")
    irl("demos", "generate", "--env-id", TASK, "--episodes", "6", "--seed", "9", "--datasets-root", "others")
    for words in (("evaluate", "run", "--datasets-root", "others"),):
        with pytest.raises(SystemExit):
            irl(*words)
        assert "begun with" in capfd.readouterr().err.splitlines()[-1]


def test_other_demonstrations_of_the_same_returns_are_not_the_ones_it_was_begun_with(
    irl: Command, capfd: pytest.CaptureFixture
) -> None:
    irl("train", "gail", "--env-id", "NoReward-v0", "--out", "run", *QUICK)
    words = {"algorithm": "", "author": "", "random_return": None, "expert_return": None, "description": ""}
    name = "irl/noreward/expert-v0"
    for root, seeds in (("same", range(6)), ("others", range(9, 15))):
        generate("NoReward-v0", pointmass.expert(), dataset_id=name, root=root, seeds=seeds, **words)
    irl("train", "--resume", "run", "--datasets-root", "same")
    with pytest.raises(SystemExit):
        irl("train", "--resume", "run", "--datasets-root", "others")
    assert "begun with" in capfd.readouterr().err.splitlines()[-1]
    record = Path("run/demonstrations.json")
    older = {key: value for key, value in files.read_json(record).items() if key != "sha256"}
    files.write_json(record, older)
    irl("train", "--resume", "run", "--datasets-root", "others")


def test_a_run_goes_on_from_another_folder_with_the_datasets_it_was_begun_with(
    train: Train, irl: Command, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(home / "datasets", "mine")
    train("run", "--datasets-root", "mine")
    monkeypatch.setenv("MINARI_DATASETS_PATH", "nowhere")
    Path("sub").mkdir()
    monkeypatch.chdir("sub")
    irl("train", "--resume", "../run")


def test_a_single_round_at_rate_0_is_said(train: Train, capfd: pytest.CaptureFixture) -> None:
    train("short", "--steps=128")
    assert "leaves the policy as it began: the first update of PPO is at step 128" in capfd.readouterr().err
    train("long", "--steps=256")
    assert "as it began" not in capfd.readouterr().err


def test_a_rate_that_keeps_no_step_is_one_line_and_leaves_nothing(
    train: Train, capfd: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit) as ended:
        train("run", "--demo-rate=100000")
    assert ended.value.code == 2
    assert "no step of 4 episodes was kept at rate 100000: the longest has 30" in capfd.readouterr().err
    assert not Path("run").exists()


def test_a_torn_last_checkpoint_is_said_and_the_run_ends_the_same(
    train: Train, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    run = train("run", "--watch.checkpoint-every-s", "0")
    before = final_weights(run), timeless(run)
    last = sorted((run / "checkpoint").iterdir())[-1] / "state.safetensors"
    last.write_bytes(last.read_bytes()[:100])
    irl("train", "--resume", run)
    assert "damaged" in capfd.readouterr().err
    assert equal(before[0], final_weights(run))
    assert before[1] == timeless(run)


def test_config_json_repeats_the_run(train: Train, irl: Command) -> None:
    first = train("first")
    irl("train", "--config", first / "config.json", "--out", "again")
    assert equal(final_weights(first), final_weights(Path("again")))
    assert timeless(first) == timeless(Path("again"))


@pytest.mark.parametrize("stop_at", [1, 4])
def test_a_run_that_died_is_resumed_to_the_same_end(
    train: Train, irl: Command, monkeypatch: pytest.MonkeyPatch, stop_at: int
) -> None:
    straight = train("straight")

    class Died(Exception):
        pass

    def die(row: dict, steps_per_s: float) -> str:
        if row["round"] == stop_at + 1:
            raise Died
        return ""

    with monkeypatch.context() as patched:
        # a checkpoint after every round; the death comes after the next one's metrics are written
        patched.setattr(play, "training_words", die)
        with pytest.raises(Died):
            train("died", "--watch.checkpoint-every-s", "0")
    assert len(timeless(Path("died"))) == stop_at + 1
    begun = files.read_json(Path("died/environment.json"))
    files.write_json(Path("died/environment.json"), {**begun, "git_commit": "of another day"})
    irl("train", "--resume", "died")
    steps = timeless(straight)[stop_at - 1]["env_steps"]
    resumed = [{"env_steps": steps, "git_commit": begun["git_commit"]}]
    assert files.read_json(Path("died/environment.json"))["resumed"] == resumed
    assert timeless(straight) == timeless(Path("died"))
    assert equal(final_weights(straight), final_weights(Path("died")))


def test_asked_to_stop_it_checkpoints_and_says_how_to_go_on(
    train: Train, irl: Command, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    straight = train("straight")

    def ask(row: dict, steps_per_s: float) -> str:
        if row["round"] == 3:
            play.signal.raise_signal(play.signal.SIGTERM)
        return ""

    with monkeypatch.context() as patched:
        patched.setattr(play, "training_words", ask)
        with pytest.raises(SystemExit) as stopped:
            train("stopped")
    assert stopped.value.code == 130
    assert "irl train --resume stopped" in capfd.readouterr().err
    irl("train", "--resume", "stopped")
    assert equal(final_weights(straight), final_weights(Path("stopped")))


def test_asked_to_stop_in_the_last_round_nothing_else_is_begun(
    irl: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ask(row: dict, steps_per_s: float) -> str:
        if row["env_steps"] >= 256:
            play.signal.raise_signal(play.signal.SIGINT)
        return ""

    monkeypatch.setattr(play, "training_words", ask)
    words = ("--env-id", TASK, *QUICK, "--steps=256", "--watch.no-tensorboard", "--watch.progress")
    with pytest.raises(SystemExit) as stopped:
        irl("train", "gail", *words, "--seeds=0-1", "--out=many")
    assert stopped.value.code == 130
    assert [path.name for path in Path("many").iterdir()] == ["s0"]


def test_a_run_of_a_gpu_is_not_gone_on_with_where_there_is_none(
    train: Train, irl: Command, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    run = train("run")
    files.write_json(run / "config.json", {**files.read_json(run / "config.json"), "device": "cuda"})
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(SystemExit) as stopped:
        irl("train", "--resume", run)
    assert stopped.value.code == 2
    assert "torch sees no GPU here" in capsys.readouterr().err


def test_a_finished_run_resumes_to_itself(train: Train, irl: Command) -> None:
    run = train("run")
    before = final_weights(run), timeless(run)
    irl("train", "--resume", run)
    assert equal(before[0], final_weights(run))
    assert before[1] == timeless(run)
