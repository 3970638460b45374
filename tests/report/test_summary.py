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
        "88 % or more",
        "40 % of",
        "Warnings: hacked.",
    ):
        assert words in text, words


def test_what_is_not_known_is_left_out_of_it(run: Path) -> None:
    assert "distance" not in " ".join(summary(read_run(run)))
