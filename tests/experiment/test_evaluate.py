"""`irl evaluate`: the fixed names, numbers that can be recomputed, and tasks of which less is known."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from irl.core import files
from irl.core.records import open_run
from irl.core.rng import episode_seeds
from irl.envs.rollouts import rollouts
from irl.policies import shelf
from irl.policies.policy import load_policy
from tests.experiment.conftest import DATASET, LOOK, QUICK, TASK

Command = Callable[..., None]


def test_numbers_of_a_run(train: Callable[..., Path], irl: Command, capsys: pytest.CaptureFixture) -> None:
    run = train("run")
    irl("evaluate", run)
    found = files.read_json(run / "evaluation.json")
    policy, reward = found["policy"], found["reward"]
    last = list(open_run(run).snapshots().values())[-1]
    seeds = episode_seeds(0, "evaluation", 20)
    assert policy["seeds"] == seeds
    returns = [e.return_ for e in rollouts(TASK, load_policy(last / "policy.safetensors"), seeds)]
    np.testing.assert_allclose(policy["returns"], returns)
    assert policy["episodes"] == 20
    assert policy["return_mean"] == pytest.approx(np.mean(returns))
    assert policy["return_std"] == pytest.approx(np.std(returns))
    low, high = (found["references"][name]["return_mean"] for name in ("random", "expert"))
    assert policy["normalised_score"] == pytest.approx((np.mean(returns) - low) / (high - low))
    assert -1 <= reward["pearson"] <= 1
    assert -1 <= reward["spearman"] <= 1
    assert 0 <= reward["auroc"] <= 1
    assert set(reward["strata"]) == {"expert", "policy", "random"}
    assert len({stratum["steps"] for stratum in reward["strata"].values()}) == 1
    assert all(-1 <= stratum["pearson"] <= 1 for stratum in reward["strata"].values())
    drift = found["drift"]
    assert drift["snapshots"] == list(open_run(run).snapshots())
    for change in drift["changes"]:
        parts = change["offset"] + change["scale"] + change["shape"]
        assert parts == pytest.approx(change["total"], rel=1e-9)
    walked = [change["path"] for change in drift["changes"]]
    assert walked == sorted(walked)
    assert walked[-1] == pytest.approx(sum(change["total"] ** 0.5 for change in drift["changes"]))
    assert "report.html" in capsys.readouterr().out
    assert "https://" not in (run / "report.html").read_text().split("<script>")[0]


def test_a_score_is_against_the_experts_card_and_not_the_demonstrations(
    train: Callable[..., Path], irl: Command
) -> None:
    run = train("run")
    irl("evaluate", run, *LOOK)
    references = files.read_json(run / "evaluation.json")["references"]
    card = shelf.find(TASK).card
    assert references["expert"]["return_mean"] == card.measured.return_mean
    assert references["random"]["return_mean"] == card.random_return_mean
    assert references["demonstrations"]["return_mean"] != card.measured.return_mean


def test_evaluation_repeats_itself_and_leaves_the_run_alone(train: Callable[..., Path], irl: Command) -> None:
    run = train("run")
    metrics = (run / "metrics.jsonl").read_bytes()
    irl("evaluate", run, *LOOK)
    first = files.read_json(run / "evaluation.json")
    irl("evaluate", run, *LOOK)
    assert files.read_json(run / "evaluation.json") == first
    assert (run / "metrics.jsonl").read_bytes() == metrics


def test_without_a_hand_written_reward_the_rest_is_still_said(irl: Command) -> None:
    irl("train", "gail", "--env-id", "NoReward-v0", "--out", "run", *QUICK)
    irl("evaluate", "run", *LOOK)
    found = files.read_json(Path("run/evaluation.json"))
    assert found["reward"]["pearson"] is None
    assert "constant" in found["reward"]["pearson_reason"]
    assert 0 <= found["reward"]["auroc"] <= 1
    assert found["drift"]["changes"]


def test_a_task_that_pays_nan_is_evaluated_too(irl: Command) -> None:
    irl("train", "gail", "--env-id", "NaNReward-v0", "--demos", DATASET, "--out", "run", *QUICK)
    irl("evaluate", "run", *LOOK)
    found = files.read_json(Path("run/evaluation.json"))
    assert found["policy"]["return_mean"] is None
    assert found["policy"]["normalised_score"] is None
    assert "not a finite number" in found["policy"]["normalised_score_reason"]
    assert found["reward"]["pearson"] is None
    assert 0 <= found["reward"]["auroc"] <= 1


def test_without_a_score_the_true_reason_is_given(irl: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("--steps=2", "--demo-episodes=2", "--learner.hidden=8", "--watch.no-progress")
    irl("train", "bc", "--env-id", "NoReward-v0", "--out", "run", *words)
    for expert, random, said in (
        (0.0, 0.0, "the expert's return and that of random actions are equal, so there is no scale"),
        (0.0, None, "no expert or random return is known for this task"),
        (None, 0.0, "no expert or random return is known for this task"),
    ):
        ends = {"expert": expert, "random": random, "demonstrations": None}
        known = {who: None if mean is None else {"return_mean": mean} for who, mean in ends.items()}
        monkeypatch.setattr("irl.experiment.evaluate.references_of", lambda *_, known=known: known)
        irl("evaluate", "run", *LOOK)
        policy = files.read_json(Path("run/evaluation.json"))["policy"]
        assert policy["normalised_score"] is None
        assert said in policy["normalised_score_reason"]


def test_with_no_episode_held_out_it_says_so(train: Callable[..., Path], irl: Command) -> None:
    run = train("run", "--demo-episodes", "6")
    irl("evaluate", run, *LOOK)
    assert "held out" in files.read_json(run / "evaluation.json")["reward"]["notes"][0]
