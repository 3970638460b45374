from pathlib import Path

import pytest

from irl.core.metrics import DECLARED
from irl.experiment.cli import main

PAGE = Path(__file__).parents[2] / "scripts" / "benchmarks" / "METRICS.md"


def test_the_page_is_what_the_command_prints(capsys: pytest.CaptureFixture) -> None:
    main(["metrics", "--markdown"])
    assert capsys.readouterr().out == PAGE.read_text(encoding="utf-8")


def test_every_name_is_shown_once_with_a_meaning_and_a_unit(capsys: pytest.CaptureFixture) -> None:
    main(["metrics"])
    shown = capsys.readouterr().out
    assert [name for name in DECLARED if name not in shown] == []
    assert all(meaning and unit and "|" not in meaning for meaning, unit in DECLARED.values())
    page = PAGE.read_text(encoding="utf-8")
    assert all(page.count(f"| `{name}` |") == 1 for name in DECLARED)
