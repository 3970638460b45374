from typing import Any

import pytest

from irl.report.amounts import amount
from irl.report.readings import MISSING, headline, key_numbers


@pytest.mark.parametrize(
    ("value", "text"),
    [(3477.4, "3,477"), (18.31, "18.3"), (3.0, "3.00"), (0.389, "0.39"), (-0.00312, "-0.0031"), (0.0, "0")],
)
def test_amounts_have_the_digits_a_person_reads(value: float, text: str) -> None:
    assert amount(value) == text


def test_a_good_run_reads_well(evaluation: dict[str, Any]) -> None:
    rows = {row.name: row for row in key_numbers(evaluation)}
    assert rows["Normalised score"].value == "0.951"
    assert (
        rows["Normalised score"].reading
        == "0 is a random policy (return 18.3), 1 is the expert (return 3,654)."
    )
    assert "over 20 episodes" in rows["Return of the policy"].reading
    assert [name for name, row in rows.items() if row.value == MISSING] == [
        "Distance to the hand-written reward"
    ]
    assert headline(evaluation).startswith("The policy gets 95 % of the way")


@pytest.mark.parametrize(
    ("r", "words"),
    [(0.95, "agrees closely"), (0.3, "agrees weakly"), (0.1, "next to nothing"), (-0.6, "runs against")],
)
def test_a_correlation_is_put_in_words(evaluation: dict[str, Any], r: float, words: str) -> None:
    evaluation["reward"]["pearson"] = r
    assert words in headline(evaluation)


def test_what_is_not_known_has_the_reason_of_the_file(evaluation: dict[str, Any]) -> None:
    evaluation["policy"].update(normalised_score=None, normalised_score_reason="this task has no expert")
    evaluation["references"].update(expert=None, expert_reason="no card for this task.")
    rows = {row.name: row for row in key_numbers(evaluation)}
    assert rows["Normalised score"].value == MISSING
    assert rows["Normalised score"].reading == "Reason: this task has no expert."
    assert rows["Return of the expert"].reading == "Reason: no card for this task."
    assert headline(evaluation).startswith("The policy returns 3,4")


def test_the_separation_is_said_to_be_by_the_logit(evaluation: dict[str, Any]) -> None:
    """It is read off the logit (judge.py), which of AIRL is no reward that is judged but f."""
    evaluation["reward"]["auroc"] = 0.95
    (row,) = [row for row in key_numbers(evaluation) if row.name == "AUROC, expert against policy"]
    assert row.value == "0.95"
    assert "In 95 % of pairs the expert's step has the higher logit (of AIRL: f)" in row.reading
    assert "earns" not in row.reading


def test_a_reward_that_stood_still_is_said_to(evaluation: dict[str, Any]) -> None:
    evaluation["drift"]["changes"][-1].update(offset=0.0, scale=0.0, shape=0.0, total=0.0)
    assert "stood still" in key_numbers(evaluation)[-1].reading


def test_the_last_move_is_the_one_that_the_figure_shows(evaluation: dict[str, Any]) -> None:
    at = evaluation["drift"]["snapshots"]
    move = {"offset": 0.9, "scale": 0.06, "shape": 0.04, "total": 1.0}
    evaluation["drift"]["moves"] = [move] * (len(at) - 1)
    assert key_numbers(evaluation)[-1].value == "4 % shape"


def test_a_correlation_over_several_kinds_of_play_says_what_it_is_within_one(
    evaluation: dict[str, Any],
) -> None:
    evaluation["reward"]["strata"]["policy"]["pearson"] = 0.62
    rows = {row.name: row for row in key_numbers(evaluation)}
    assert "within the policy's own steps r = 0.62" in rows["Agreement per step"].reading
