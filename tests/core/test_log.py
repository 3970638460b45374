"""A log is appended to: what is read is what came, and damage is said."""

from pathlib import Path

import pytest
import torch

from irl.core.errors import UserError
from irl.core.log import Columns, Log, Logs, Rows, Segment

DATA = torch.arange(100.0)


def log(start: int, stop: int, asked: list[tuple[int, int]] | None = None) -> Log:
    def read(first: int, last: int) -> Columns:
        if asked is not None:
            asked.append((first, last))
        return {"x": DATA[first:last]}

    return Log("numbers", start, stop, read)


def numbers(rows: Rows) -> list[float]:
    every = [(first + i, x) for first, columns in rows.pieces for i, x in enumerate(columns["x"].tolist())]
    assert all(i == x for i, x in every)
    return [x for _, x in every if x >= rows.start]


def test_only_new_rows_are_read_and_written(tmp_path: Path) -> None:
    logs, asked = Logs(tmp_path), []
    for stop in (10, 10, 25):
        segments = logs.append(log(0, stop, asked))
    assert asked == [(0, 10), (10, 25)]
    assert numbers(Logs(tmp_path).load("numbers", 0, 25, segments)) == list(range(25))


def test_pieces_that_nobody_needs_are_left_out_and_deleted(tmp_path: Path) -> None:
    logs = Logs(tmp_path)
    for start, stop in ((0, 10), (5, 20), (12, 30)):
        segments = logs.append(log(start, stop))
    assert [(first, last) for first, last, _ in segments] == [(10, 20), (20, 30)]
    logs.drop_all_but(("numbers", segment) for segment in segments)
    assert len(list(tmp_path.iterdir())) == 2
    assert numbers(logs.load("numbers", 12, 30, segments)) == list(range(12, 30))


def test_after_a_fall_back_the_rows_are_written_again(tmp_path: Path) -> None:
    logs = Logs(tmp_path)
    older = logs.append(log(0, 10))
    newer = logs.append(log(0, 20))
    resumed = Logs(tmp_path)
    resumed.load("numbers", 0, 10, older)
    asked: list[tuple[int, int]] = []
    assert resumed.append(log(0, 20, asked)) == newer
    assert asked == [(10, 20)]


@pytest.mark.parametrize("damage", ["missing", "torn", "flipped"])
def test_a_damaged_piece_is_said(damage: str, tmp_path: Path) -> None:
    segments: list[Segment] = Logs(tmp_path).append(log(0, 10))
    (path,) = tmp_path.iterdir()
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.unlink()
    if damage != "missing":
        path.write_bytes(bytes(content) if damage == "flipped" else bytes(content[:-5]))
    with pytest.raises(UserError, match=r"numbers-.* is damaged"):
        Logs(tmp_path).load("numbers", 0, 10, segments)


def test_a_name_that_would_lead_elsewhere_is_refused(tmp_path: Path) -> None:
    (segment,) = Logs(tmp_path / "a").append(log(0, 10))
    with pytest.raises(UserError, match="is not the name of a log"):
        Logs(tmp_path / "b").load("../a/numbers", 0, 10, [segment])
