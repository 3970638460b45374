from typing import Any

import pytest
from rich.console import Console

from irl.report.tables import evaluation_table


def _printed(evaluation: dict[str, Any], width: int = 100) -> str:
    console = Console(width=width, record=True, file=None, color_system=None)
    with console.capture() as capture:
        console.print(evaluation_table(evaluation))
    return capture.get()


def test_the_table_names_the_run_and_its_numbers(evaluation: dict[str, Any]) -> None:
    text = _printed(evaluation)
    for expected in (
        "quickstart, gail, Hopper-v5, 122,880 steps",
        "0.951",
        "held-out expert",
        "Note: the probe",
    ):
        assert expected in text


@pytest.mark.parametrize("width", [60, 80, 200])
def test_the_table_fits_the_terminal(evaluation: dict[str, Any], width: int) -> None:
    assert max(len(line) for line in _printed(evaluation, width).splitlines()) <= width


def test_markup_in_strings_is_not_followed(evaluation: dict[str, Any]) -> None:
    evaluation["run"] = "[red]quick[/red][/nothing]"
    evaluation["reward"]["notes"] = ["[bold]x"]
    text = _printed(evaluation)
    assert "[red]quick[/red][/nothing]" in text
    assert "[bold]x" in text


def test_an_empty_evaluation_prints_reasons() -> None:
    assert _printed({}).count("not known") == 11
