"""The evaluation as `irl evaluate` prints it: key numbers, then the reward by kind of play."""

from collections.abc import Mapping
from typing import Any

from rich import box
from rich.console import Group
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from irl.report.amounts import amount, spread
from irl.report.folder import lookup, number, texts
from irl.report.palette import STRATA, STRATUM_NAMES
from irl.report.probed import DISTANCES, DRIFT, HEALTH, distance_table, drift_table, health_table
from irl.report.readings import MISSING, key_numbers
from irl.report.terms import TERMS, terms_table


def evaluation_table(evaluation: Mapping[str, Any]) -> Group:
    """What to print of an evaluation.json that was read: tables and the notes.

    Strings of the file are shown as they are: markup in them is not followed.
    """
    parts: list[Table | Padding] = [_numbers(evaluation)]
    if isinstance(lookup(evaluation, "reward.strata"), Mapping):
        parts.append(_strata(evaluation))
    distances = (distance_table(evaluation), DISTANCES)
    drift = (drift_table(evaluation), DRIFT)
    terms, health = (terms_table(evaluation), TERMS), (health_table(evaluation), HEALTH)
    for table, legend in (distances, terms, drift, health):
        if table is not None:
            parts += [table, Padding(Text(legend, style="dim"), (0, 1))]
    for part in ("policy.notes", "reward.notes", "distances.notes", "drift.notes", "notes"):
        parts += [
            Padding(Text(f"Note: {note}", style="dim"), (0, 1)) for note in texts(lookup(evaluation, part))
        ]
    return Group(*parts)


def _numbers(evaluation: Mapping[str, Any]) -> Table:
    names = [str(evaluation[key]) for key in ("run", "method", "env_id") if evaluation.get(key)]
    steps = number(evaluation, "env_steps")
    title = ", ".join(names + ([] if steps is None else [f"{steps:,.0f} steps"]))
    table = Table(box=box.SIMPLE_HEAD, title=Text(title, style="bold"), title_justify="left", expand=False)
    table.add_column("measured")
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("what it says", ratio=1)
    for row in key_numbers(evaluation):
        known = row.value != MISSING
        value = Text(row.value, style="bold" if known else "dim")
        table.add_row(Text(row.name), value, Text(row.reading, style="" if known else "dim"))
    return table


def _strata(evaluation: Mapping[str, Any]) -> Table:
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("mean reward of a step")
    for name in ("learned", "hand-written", "r within", "steps"):
        table.add_column(name, justify="right")
    for name in STRATA:
        path = f"reward.strata.{name}"
        mean, hand_written = (
            number(evaluation, f"{path}.mean"),
            number(evaluation, f"{path}.hand_written_mean"),
        )
        steps, within = number(evaluation, f"{path}.steps"), number(evaluation, f"{path}.pearson")
        table.add_row(
            STRATUM_NAMES[name],
            MISSING if mean is None else spread(mean, number(evaluation, f"{path}.std")),
            MISSING if hand_written is None else amount(hand_written),
            MISSING if within is None else f"{within:.2f}",
            MISSING if steps is None else f"{steps:,.0f}",
        )
    return table
