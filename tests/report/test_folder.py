from pathlib import Path

import pytest

from irl.core.errors import UserError
from irl.report.folder import column, finite, lookup, number, read_run, why_missing


def test_a_run_is_read_whole(run: Path) -> None:
    files = read_run(run)
    assert files.name == "quickstart"
    assert files.config["kind"] == "gail"
    assert len(files.metrics) == 60
    assert files.problems == {}


def test_half_a_line_is_left_out_and_said(run: Path) -> None:
    with (run / "metrics.jsonl").open("a") as file:
        file.write('{"round": 60, "env_st')
    files = read_run(run)
    assert len(files.metrics) == 60
    assert files.problems["metrics.jsonl"] == "metrics.jsonl: 1 of 61 lines cannot be read and are left out"


def test_numbers_that_json_does_not_have_are_missing(run: Path) -> None:
    (run / "metrics.jsonl").write_text(
        '{"env_steps": 1, "return_mean": NaN}\n{"env_steps": 2, "return_mean": 1e999}\n'
    )
    assert column(read_run(run).metrics, "env_steps", "return_mean") == ([], [])


@pytest.mark.parametrize("value", [None, True, "1", [1], float("nan"), float("-inf"), 10**400])
def test_only_finite_numbers_are_numbers(value: object) -> None:
    assert finite(value) is None


def test_lookup_follows_dots_and_stops_at_nothing() -> None:
    assert lookup({"a": {"b": 3}}, "a.b") == 3
    assert lookup({"a": [1]}, "a.b") is None
    assert number({"a": {"b": 3}}, "a.b") == 3.0


def test_reasons_are_looked_for_from_near_to_far() -> None:
    own = {"reward": {"auroc": None, "auroc_reason": "own", "notes": ["beside"]}, "notes": ["far"]}
    assert why_missing(own, "reward.auroc") == "own"
    shared = {"reward": {"pearson_reason": "no hand-written reward", "notes": ["beside"]}}
    assert why_missing(shared, "reward.episode_spearman") == "no hand-written reward"
    assert why_missing({"reward": {"notes": ["one", "two"]}}, "reward.auroc") == "one; two"
    assert why_missing({"drift": None, "drift_reason": "no snapshots"}, "drift.changes") == "no snapshots"
    assert (
        why_missing({"run": "x"}, "drift.changes")
        == "evaluation.json gives neither drift.changes nor a reason"
    )
    assert "irl evaluate" in why_missing({}, "drift.changes")


def test_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nothing"):
        read_run(tmp_path / "nothing")
