from typing import Any

import plotly.graph_objects as go

from irl.report import plots
from irl.report.palette import STRATA


def _traces(figure: go.Figure) -> Any:
    return figure.data


def _layout(figure: go.Figure) -> Any:
    return figure.layout


def _named(figure: go.Figure, name: str) -> Any:
    return next(trace for trace in _traces(figure) if (trace.name or "").startswith(name))


def test_learning_curve_leaves_out_rounds_without_a_return() -> None:
    rows = [
        {"env_steps": 1, "return_mean": None},
        {"env_steps": 2, "return_mean": 5.0, "eval_return_mean": 7.0},
        {"env_steps": 3, "return_mean": float("nan")},
    ]
    figure = plots.learning_curve(rows, {"expert": 10.0, "random": 1.0})
    assert list(_named(figure, "training").y) == [5.0]
    assert list(_named(figure, "evaluation").y) == [7.0]
    assert list(_named(figure, "expert").x) == [0, 3]
    assert [trace.name for trace in _traces(figure)][-1] == "random 1.00"


def test_a_long_curve_is_thinned() -> None:
    rows = [{"env_steps": i, "return_mean": float(i)} for i in range(9000)]
    assert len(_named(plots.learning_curve(rows, {}), "training").x) <= plots.LINE_POINTS


def test_bands_keep_only_whole_snapshots_and_lie_under_the_lines() -> None:
    strata = {"expert": {"p10": [0.0, None, 1.0], "median": [1, 2, 2], "p90": [2.0, 3.0, 3.0]}}
    figure = plots.reward_by_stratum([0, 10, 20], strata)
    band, line = _traces(figure)
    assert list(band.x) == [0, 20, 20, 0]
    assert list(band.y) == [2, 3, 1, 0]
    assert list(line.y) == [1, 2]
    assert line.line.color == STRATA["expert"]


def test_scatter_groups_by_stratum_and_is_limited() -> None:
    n = 3 * plots.SCATTER_POINTS
    figure = plots.learned_against_hand_written(
        [float(i) for i in range(n)] + [None], [1.0] * (n + 1), ["expert"] * (n - 1) + ["random", "policy"]
    )
    assert [trace.name for trace in _traces(figure)] == ["random", "held-out expert"]
    assert len(_traces(figure)[1].x) <= plots.SCATTER_POINTS
    assert float(_traces(figure)[0].y[0]) == n - 1
