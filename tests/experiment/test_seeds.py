"""`--seeds`: a run folder each, to the bit what it would be alone, and one summary."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from irl.core import files
from irl.core.config import to_json
from irl.core.records import RunFolder, create, open_run
from irl.experiment.configs import BCRun, GAILRun
from irl.experiment.seeds import summary
from irl.policies import shelf
from irl.policies.policy import load_policy
from tests import pointmass
from tests.experiment.conftest import QUICK, TASK
from tests.policies.test_shelf import a_card

Command = Callable[..., None]
WORDS = ("--env-id", TASK, *QUICK, "--steps=256", "--watch.no-tensorboard")


def weights(run: Path) -> dict[str, np.ndarray]:
    return load_policy(list(open_run(run).snapshots().values())[-1] / "policy.safetensors").weights


def test_each_seed_is_as_it_is_alone_and_the_summary_says_what_they_come_to(
    irl: Command, capsys: pytest.CaptureFixture
) -> None:
    irl("train", "gail", *WORDS, "--seeds", "3,0-1", "--out", "many")
    irl("train", "gail", *WORDS, "--seed", "1", "--out", "alone")
    together, alone = weights(Path("many/s1")), weights(Path("alone"))
    assert all(np.array_equal(together[name], alone[name]) for name in alone)
    found = files.read_json(Path("many/seeds.json"))
    assert [row["seed"] for row in found["seeds"]] == [3, 0, 1]
    scores = sorted(row["score"] for row in found["seeds"])
    assert found["iqm"] == pytest.approx(np.mean(scores))
    # where seeds are level, a mean of them is off by its last digit
    low, high = found["interval_95"]
    assert scores[0] - 1e-12 <= low <= high <= scores[-1] + 1e-12
    assert files.read_json(Path("many/s3/config.json"))["seed"] == 3
    printed = " ".join(capsys.readouterr().out.split())
    assert "interquartile mean of the normalised score" in printed
    # again: nothing is trained anew, one more seed is begun
    before = (Path("many/s0") / "metrics.jsonl").read_bytes()
    irl("train", "gail", *WORDS, "--seeds", "0,2", "--out", "many")
    assert (Path("many/s0") / "metrics.jsonl").read_bytes() == before
    assert [row["seed"] for row in files.read_json(Path("many/seeds.json"))["seeds"]] == [0, 2]
    with pytest.raises(SystemExit):
        irl("train", "gail", *WORDS, "--seeds", "0,2", "--out", "many", "--discriminator.lr", "0.1")
    assert "many/s0 is there with other settings: discriminator.lr was" in capsys.readouterr().err


def test_one_seed_has_no_interval_and_an_unmeasured_run_no_score(irl: Command) -> None:
    words = ("--steps=20", "--learner.steps-per-round=20", "--watch.no-progress", "--watch.eval-episodes=0")
    irl("train", "bc", "--env-id", TASK, "--demo-episodes=2", *words, "--seeds", "5", "--out", "one")
    found = files.read_json(Path("one/seeds.json"))
    assert (found["iqm"], found["interval_95"]) == (None, [None, None])
    assert "without an evaluation" in found["interval_95_reason"]


def test_the_episodes_are_those_that_were_played_and_not_those_typed_last(
    irl: Command, capsys: pytest.CaptureFixture
) -> None:
    words = ("--steps=20", "--demo-episodes=2", "--learner.steps-per-round=20", "--watch.no-progress")
    command = ("train", "bc", "--env-id", TASK, *words, "--out", "many")
    irl(*command, "--seeds", "0-1", "--watch.eval-episodes", 2)
    capsys.readouterr()
    irl(*command, "--seeds", "0-1", "--watch.eval-episodes", 3)
    assert files.read_json(Path("many/seeds.json"))["evaluation_episodes"] == 2
    assert "last evaluation of each seed, 2 episodes" in " ".join(capsys.readouterr().out.split())
    # what is there was evaluated, whatever is typed
    irl(*command, "--seeds", "0-1", "--watch.eval-episodes", 0)
    assert files.read_json(Path("many/seeds.json"))["interval_95_reason"] is None
    capsys.readouterr()
    irl(*command, "--seeds", "0-2", "--watch.eval-episodes", 3)
    found = files.read_json(Path("many/seeds.json"))
    assert found["evaluation_episodes"] == [2, 3]
    assert [row["evaluation_episodes"] for row in found["seeds"]] == [2, 2, 3]
    assert "2 or 3 episodes, as each was begun" in " ".join(capsys.readouterr().out.split())


def begun(tmp_path: Path, env_id: str) -> list[RunFolder]:
    runs = [GAILRun(env_id, seed=seed, out=tmp_path / str(seed)).resolved() for seed in (0, 1)]
    return [create(tmp_path / str(run.seed), to_json(run), {}) for run in runs]


def test_without_a_scale_the_returns_are_what_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    policy = pointmass.expert("NoReward-v0")
    flat = replace(a_card(policy), random_return_mean=0.0)
    shelf.write(tmp_path / "shelf" / "noreward" / "expert", policy, flat)
    monkeypatch.setenv("IRL_POLICIES_PATH", str(tmp_path / "shelf"))
    runs = begun(tmp_path, "NoReward-v0")
    for run in runs:
        run.append({"round": 1, "env_steps": 10, "eval_return_mean": 0.0})
    found = summary(GAILRun("NoReward-v0", seeds="0-1"), runs)
    assert (found["measured"], found["iqm"], found["interval_95_reason"]) == ("eval_return_mean", 0.0, None)


def test_a_return_that_is_no_number_is_the_reason(tmp_path: Path) -> None:
    runs = begun(tmp_path, "NoReward-v0")
    for run, value in zip(runs, (1.0, np.nan), strict=True):
        run.append({"round": 1, "env_steps": 10, "eval_return_mean": value})
    found = summary(GAILRun("NoReward-v0", seeds="0-1"), runs)
    assert found["interval_95_reason"] == "a return is not a finite number"


@pytest.mark.parametrize("words", ["a", "4-0", "1,1", "0-3,2", "-1", ",", "0-99999"])
def test_seeds_that_are_none_are_refused(words: str) -> None:
    with pytest.raises(ValueError, match="seeds"):
        GAILRun(TASK, seeds=words)


def test_a_seed_and_several_are_refused() -> None:
    with pytest.raises(ValueError, match="one of --seed 1 and --seeds 0-1"):
        BCRun(TASK, seed=1, seeds="0-1")
    assert GAILRun(TASK, seeds="0-2,7").seed_numbers == (0, 1, 2, 7)
