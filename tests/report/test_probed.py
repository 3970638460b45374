"""The tables of distances and drift, of what a file holds and of what it lacks."""

from typing import Any

import pytest
from rich.console import Console

from irl.report.tables import evaluation_table


def row(value: float | None, self_error: float = 0.01, **more: Any) -> dict[str, Any]:
    known = {"name": "VAL", "n": 50, "value": value, "low": 0.1, "high": 0.4, "self_error": self_error}
    told = None if value is None else value > self_error
    return known | {"random": 0.6, "episodes": 30, "distinguishable": told, "reason": None} | more


@pytest.fixture
def probed(evaluation: dict[str, Any]) -> dict[str, Any]:
    strata = {
        "expert": row(0.123, covered=False, episodes=2),
        "random": row(0.005, covered=True),
    }
    distances = {
        "probe_sha256": "abcdef0123456789",
        "steps": 8000,
        "episodes": 60,
        "curve": [
            row(0.25, n=1),
            row(0.004),
            row(None, n=100, reason="segments of 100 steps fit into 0 of 60"),
        ],
        # of files that are older, which are read all the same
        "uncentred": 0.25,
        "references": [row(0.31, name="epic", n=None)],
        "strata": strata,
        "notes": ["medium: no medium policy is shelved"],
    }
    n = len(evaluation["drift"]["snapshots"])
    health = {"auroc": 0.91, "jsd_bound": 0.2, "ece": 0.1}
    evaluation["distances"] = distances
    evaluation["drift"] |= {
        "n": 50,
        "cycling": 2.5,
        "normaliser": {"moved": False, "frozen": None},
        "to_truth": [row(0.3)] * n,
        "speed": [0.111] * (n - 1),
        "moves": [{"shares": {"shape": 0.77}}] * (n - 1),
        "shift": [{"pair_flips": 0.22}] * (n - 1),
        "health": [{"train": health, "held_out": health, "memorised": 0.03, "slope_p99": 2.0}] * n,
        "hygiene": [{"survival_bias": 0.95}] * n,
        "outside": [0.44] * (n - 1) + [None],
    }
    return evaluation


def printed(evaluation: dict[str, Any], width: int = 120) -> str:
    console = Console(width=width, color_system=None)
    with console.capture() as capture:
        console.print(evaluation_table(evaluation))
    return capture.get()


def test_the_tables_say_what_was_measured(probed: dict[str, Any]) -> None:
    text = printed(probed)
    for expected in (
        "base probe abcdef012345, 8,000 steps of 60 episodes",
        "VAL over 1 steps",
        "not distinguishable",
        "segments of 100",
        "epic",
        "within expert, 2 episodes: few",
        "path 2.5 times the way",
        "0.77",
        "no medium policy is shelved",
    ):
        assert expected in text, expected


def test_the_first_snapshot_moved_from_nowhere(probed: dict[str, Any]) -> None:
    lines = [line.split() for line in printed(probed).splitlines()]
    first = next(words for words in lines if len(words) == 7 and words[0] == "0")
    assert first[1:4] == ["0.300", "-", "-"]


def test_a_distance_below_its_own_error_is_no_number_in_the_drift_either(probed: dict[str, Any]) -> None:
    probed["drift"]["to_truth"] = [row(0.004)] * len(probed["drift"]["snapshots"])
    lines = [line.split() for line in printed(probed).splitlines()]
    assert next(words for words in lines if len(words) == 7 and words[0] == "0")[1] == "n.d."


def test_where_nothing_is_held_out_it_is_of_training_demonstrations_and_bounds_nothing(
    probed: dict[str, Any],
) -> None:
    def words() -> str:
        return " ".join(printed(probed).split("the discriminator")[1].split())

    assert words().startswith("step AUROC by heart JSD ≥ ECE slope")
    for row in probed["drift"]["health"]:
        row |= {"held_out": None, "memorised": None}
    assert words().startswith(", on training demonstrations step AUROC ECE slope ")
    assert " 0 0.91 0.10 2.0 " in words()


def test_no_number_is_cut_short_in_eighty_columns(probed: dict[str, Any]) -> None:
    drift = printed(probed, 80).split("drift, over 50 steps")[1]
    assert "…" not in drift


@pytest.mark.parametrize("width", [60, 80])
def test_they_fit_the_terminal(probed: dict[str, Any], width: int) -> None:
    assert max(len(line) for line in printed(probed, width).splitlines()) <= width


def test_terms_have_weights_or_the_reason_why_not(evaluation: dict[str, Any]) -> None:
    known = {"weight": 0.37, "low": 0.3, "high": 0.4, "standardised": 0.8, "share": 0.6, "why_not": None}
    weights = {"forward": known, "ctrl": {**known, "why_not": "it is 3e-07 of the variance here"}}
    more = {"explained": 0.9, "shaping": 0.2, "survival_bonus": 0.75, "reason": None}
    evaluation["terms"] = {"weights": weights} | more
    text = printed(evaluation, 80)
    for expected in ("0.370", "0.3 to 0.4", "0.80", "it is 3e-07", "+0.75", "0.90"):
        assert expected in text, expected
    (of_ctrl,) = [line for line in text.splitlines() if line.strip().startswith("ctrl")]
    assert "0.370" not in of_ctrl
    evaluation["terms"] = {"reason": "no terms"}
    assert "what it pays for" not in printed(evaluation)


def test_a_file_without_them_has_no_such_tables(evaluation: dict[str, Any]) -> None:
    assert "own error" not in printed(evaluation)
    evaluation["distances"] = {"curve": "x"}
    evaluation["drift"]["health"] = 3
    assert "own error" not in printed(evaluation)
    evaluation["distances"] = {"curve": [None, 3], "strata": {"a": None}}
    evaluation["drift"]["health"] = [None]
    assert "own error" in printed(evaluation)
