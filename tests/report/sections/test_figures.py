"""What the figures show of numbers whose answer is known."""

from typing import Any

import pytest

from irl.report.palette import CHANGES
from irl.report.sections import compare, crossplay, maps, moved, viewer
from irl.report.verdict import state


def drawn(figure: Any) -> list[Any]:
    return list(figure.data)


def test_a_row_of_the_matrix_is_ranked_and_columns_stand_by_truth() -> None:
    policies = [{"name": "good", "true_return": 9.0}, {"name": "bad", "true_return": 1.0}]
    found = {"snapshots": [0], "policies": policies, "learned": [[-3.0, 5.0]]}
    (heat,) = drawn(crossplay.matrix(found))
    assert [list(row) for row in heat.z] == [[1.0, 0.0]]
    assert crossplay.ranked([2.0, None, 2.0, 5.0]) == [0.25, None, 0.25, 1.0]


def test_shares_of_a_change_add_up() -> None:
    changes = [{"offset": 1.0, "scale": 1.0, "shape": 2.0, "total": 4.0}]
    health = {f"accuracy on {who} steps": ([], []) for who in ("expert", "policy")}
    health |= {f"AUROC, {who}": ([], []) for who in ("held-out expert", "training demonstrations")}
    change, *shares = drawn(moved.figure([0.0, 100.0], changes, health, "linear"))
    assert list(change.y) == [2.0]
    assert [trace.name for trace in shares] == list(CHANGES)
    assert sum(trace.y[-1] for trace in shares) == pytest.approx(100)


def test_the_star_is_where_the_hand_written_reward_is() -> None:
    *_, star = drawn(maps.path([[0.0, 1.0], [None, None], [0.5, 0.25]], ["0", "1", "hand-written"]))
    assert (star.x[0], star.y[0]) == (0.5, 0.25)


@pytest.mark.parametrize(
    ("name", "fired", "expected"),
    [
        ("hacked", True, "warning"),
        ("hacked", False, "good"),
        ("stable", True, "good"),
        ("stable", False, "warning"),
        ("close", True, "good"),
        ("close", False, "warning"),
        ("flat", None, "unknown"),
    ],
)
def test_a_verdict_is_good_news_or_bad(name: str, fired: bool | None, expected: str) -> None:
    assert state({"name": name, "fired": fired}) == expected


def test_the_mean_of_curves_is_where_all_are() -> None:
    x, y = compare.mean_of([([0.0, 10.0], [0.0, 10.0]), ([5.0, 20.0], [5.0, 20.0])])
    assert (x[0], x[-1]) == (5.0, 10.0)
    assert y == pytest.approx(x)


def test_the_traces_of_an_episode_are_learned_hand_written_and_terms() -> None:
    row = {"learned": [1.0, 2.0], "hand_written": [3.0, None], "terms": {"ctrl": [-1.0, -2.0]}}
    series = viewer.traces(row)
    assert list(series) == ["learned", "hand-written", "ctrl"]
    assert [list(trace.y) for trace in drawn(viewer.figure(series, 0.01))] == [
        [1.0, 2.0],
        [3.0, None],
        [-1.0, -2.0],
    ]
