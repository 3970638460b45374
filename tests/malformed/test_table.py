"""Every malformed input: exit status 2, one line that says what is wrong, and not a byte changed."""

from collections.abc import Callable
from pathlib import Path

import gymnasium as gym
import pytest

from tests.experiment.conftest import TASK
from tests.malformed import commands, datasets, environments, imports, runs
from tests.malformed.conftest import refused, tree
from tests.malformed.table import Case

PARTS = (
    datasets.FILES,
    datasets.VALUES,
    runs.SETTINGS,
    runs.REST,
    commands.SHELF,
    commands.ENVIRONMENTS,
    commands.REUSED,
    commands.GATES,
    commands.PLACES,
    imports.FILES,
    imports.CURATED,
)
TABLE: dict[str, Case] = {name: case for part in PARTS for name, case in part.items()}


def test_the_table_is_long_and_no_row_hides_another() -> None:
    assert len(TABLE) == sum(map(len, PARTS)) >= 60


@pytest.mark.parametrize("name", TABLE)
def test_a_malformed_input_is_one_line_and_changes_nothing(
    name: str,
    irl: Callable[..., None],
    world: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture,
) -> None:
    case = TABLE[name]
    (world / "notes.txt").write_text("mine")
    case.damage(world)
    if case.fault:
        monkeypatch.setitem(gym.registry, TASK, environments.spec(case.fault))
    before = tree(world)
    line = refused(lambda: irl(*case.words.split()), capfd)
    assert [word for word in case.named if word not in line] == [], line
    assert len(line) < 1000
    assert tree(world) == before
