"""Tables that scripts/benchmarks makes stand in its documents as its committed JSON says."""

from importlib import import_module
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[1] / "scripts" / "benchmarks"


@pytest.fixture(autouse=True)
def beside(monkeypatch: pytest.MonkeyPatch) -> None:
    """The scripts import each other by name."""
    monkeypatch.syspath_prepend(BENCHMARKS)


def lines(document: str) -> list[str]:
    return (BENCHMARKS / document).read_text(encoding="utf-8").splitlines()


def test_findings_have_every_judged_reward() -> None:
    truth = import_module("truth")

    made = truth.table(truth.Settings()).splitlines()
    assert len(made) > 15
    assert [line for line in made if line not in lines("FINDINGS.md")] == []


def test_switches_have_every_score() -> None:
    switches = import_module("switches")

    made = switches.table(switches.Settings()).splitlines()
    assert len(made) > 20
    assert [line for line in made if line not in lines("SWITCHES.md")] == []
