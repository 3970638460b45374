import json
from pathlib import Path
from typing import Any

import pytest

from irl.report.folder import read_run
from irl.report.summary import closeness, summary
from tests.report import whole


@pytest.mark.parametrize(
    ("value", "own", "random", "words"),
    [
        (0.01, 0.02, 0.6, "cannot be told"),
        (0.1, 0.02, 0.6, "close"),
        (0.2, 0.02, 0.6, "in part"),
        (0.35, 0.02, 0.6, "far"),
        (0.5, 0.02, 0.6, "random network"),
        (0.1, None, None, "close"),
    ],
)
def test_a_distance_is_put_in_words(
    value: float, own: float | None, random: float | None, words: str
) -> None:
    assert words in closeness(value, own, random)


def test_the_page_begins_with_what_it_comes_to(run: Path, evaluation: dict[str, Any]) -> None:
    whole.write(run, whole.grow(evaluation, 9))
    text = " ".join(summary(read_run(run)))
    for words in (
        "0.22 (0.18 to 0.25)",
        "95 % of pairs of policies",
        "get 88 % of the way from random actions to the policy beside it",
        "40 % of",
        "Warnings: not close, hacked.",
        "20 episodes of one training seed",
        "forward 60 %",
        "30 % is nothing the hand-written has",
        "No reward of this kind can say the task.",
    ):
        assert words in text, words


@pytest.mark.parametrize(
    ("weight", "low", "high", "why_not", "said"),
    [
        (0.3, 0.2, 0.4, None, "ctrl 31 %, forward 15 %;"),
        (-889.4, -950.2, -694.3, None, "ctrl 31 % with the opposite sign, forward 15 %;"),
        (-889.4, -950.2, -694.3, "4e-07", "the opposite sign (a weight that is not identifiable), forward"),
        (0.04, -0.02, 0.07, None, "ctrl 31 % with a sign that is not known, forward"),
        (-0.04, None, None, None, "ctrl 31 % with the opposite sign, forward"),
    ],
)
def test_a_share_says_the_sign_of_its_weight(
    run: Path,
    evaluation: dict[str, Any],
    weight: float,
    low: float | None,
    high: float | None,
    why_not: str | None,
    said: str,
) -> None:
    """A reward that pays for large actions pays for ctrl the other way round."""
    forward = {"weight": 0.28, "low": 0.17, "high": 0.41, "share": 0.15, "why_not": None}
    ctrl = {"weight": weight, "low": low, "high": high, "share": 0.31, "why_not": why_not}
    constant = {"weight": None, "low": None, "high": None, "share": 0.0, "why_not": "it is 1 on every step"}
    weights = {"forward": forward, "ctrl": ctrl, "survive": constant}
    evaluation["terms"] = {"weights": weights, "explained": 0.46}
    (run / "evaluation.json").write_text(json.dumps(evaluation))
    text = " ".join(summary(read_run(run)))
    assert said in text
    assert "survive" not in text


def test_a_reward_that_was_nearer_before_is_said_to_have_gone_away(
    run: Path, evaluation: dict[str, Any]
) -> None:
    drift = {"snapshots": [0, 10, 20], "to_truth": [{"value": v} for v in (0.5, 0.1, 0.2)], "outside": [0.0]}
    evaluation["drift"] |= drift
    (run / "evaluation.json").write_text(json.dumps(evaluation))
    text = " ".join(summary(read_run(run)))
    assert "nearer before (0.10 at step 10)" in text
    assert "outside the probe" not in text
    drift["to_truth"][2]["value"] = 0.12
    (run / "evaluation.json").write_text(json.dumps(evaluation))
    assert "nearer before" not in " ".join(summary(read_run(run)))


def test_what_is_not_known_is_left_out_of_it(run: Path) -> None:
    assert "distance" not in " ".join(summary(read_run(run)))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"part": "hand-written"}, "get 88 % of"),
        ({"dynamics": "mass=1.5"}, "get 88 % of"),
        ({"ratio": {"value": 0.25}}, "25 % or more"),
    ],
)
def test_what_fresh_policies_reach_is_of_the_reward_where_it_was_learned(
    run: Path, evaluation: dict[str, Any], more: dict[str, Any], said: str
) -> None:
    whole.write(run, evaluation)
    (row,) = json.loads((run / "retrained.json").read_text())["rows"]
    other = row | {"ratio": {"value": 0.1}} | more
    (run / "retrained.json").write_text(json.dumps({"rows": [row, other]}))
    assert said in " ".join(summary(read_run(run)))
    (run / "retrained.json").write_text(json.dumps({"rows": [row | {"part": "hand-written"}]}))
    assert "irl retrain tries that" in " ".join(summary(read_run(run)))
    without = row | {"ratio": {"value": None}, "ratio_reason": "there is nothing to be a ratio to"}
    (run / "retrained.json").write_text(json.dumps({"rows": [without]}))
    assert "no ratio: there is nothing to be a ratio to." in " ".join(summary(read_run(run)))
