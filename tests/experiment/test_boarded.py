from pathlib import Path

from irl.experiment.boarded import board, curves_of

DRIFT = {
    "snapshots": [0, 10],
    "to_truth": [{"value": 0.5}, {"value": None}],
    "speed": [0.2],
    "moves": [{"shares": {"shape": 0.75}}],
    "health": [
        {"held_out": {"auroc": 0.9}, "train": {"auroc": 1.0}},
        {"held_out": None, "train": {"auroc": 1.0}},
    ],
    "outside": [0.1, 0.3],
}


def test_curves_are_at_the_snapshots_and_leave_out_what_is_not_known() -> None:
    found = curves_of(DRIFT)
    assert found["drift/to_truth"] == [(0, 0.5)]
    assert found["drift/speed"] == [(10, 0.2)]
    assert found["drift/shape"] == [(10, 0.75)]
    assert found["drift/auroc"] == [(0, 0.9), (10, 1.0)]


def test_the_curves_of_an_earlier_evaluation_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "tensorboard").mkdir()
    for _ in range(2):
        board(tmp_path, DRIFT)
    assert len(list((tmp_path / "tensorboard" / "evaluation").iterdir())) == 1


def test_a_run_without_curves_gets_none(tmp_path: Path) -> None:
    board(tmp_path, DRIFT)
    assert list(tmp_path.iterdir()) == []
