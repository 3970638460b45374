"""The distances and the drift of an evaluation as `irl evaluate` prints them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from irl.report.folder import finite, lookup, number

GREY = "dim"
UNKNOWN = "-"


def distance_table(evaluation: Mapping[str, Any]) -> Table | None:
    """Distances over the base probe and within each stratum; None where there are none."""
    curve = lookup(evaluation, "distances.curve")
    if not isinstance(curve, list):
        return None
    table = Table(box=box.SIMPLE_HEAD, title=_bold(_title(evaluation)), title_justify="left")
    table.add_column("distance to the hand-written reward")
    for name in ("value", "95 %", "own error", "random"):
        table.add_column(name, justify="right")
    named = lookup(evaluation, "distances.references")
    for row in [*curve, *(named if isinstance(named, list) else [])]:
        _add(table, _name(row), row)
    strata = lookup(evaluation, "distances.strata")
    for name, row in strata.items() if isinstance(strata, Mapping) else []:
        few = lookup(row, "covered") is not True
        episodes = number(row, "episodes") or 0.0
        _add(table, f"  within {name}" + (f", {episodes:.0f} episodes: few" if few else ""), row, grey=few)
    return table


def drift_table(evaluation: Mapping[str, Any]) -> Table | None:
    """What moved, a row a snapshot; None where that was not measured."""
    columns = ("step", "to truth", "moved", "shape", "turned", "bonus", "outside")
    return _by_snapshot(evaluation, _drift_title(evaluation), columns, _moved)


def health_table(evaluation: Mapping[str, Any]) -> Table | None:
    """How well the discriminator tells, a row a snapshot; None where that was not measured.

    Of the demonstrations that it learned from where none is held out: those bound no divergence.
    """
    if _held_out(evaluation):
        columns = ("step", "AUROC", "by heart", "JSD ≥", "ECE", "slope")
        return _by_snapshot(evaluation, "the discriminator", columns, _health)
    title, columns = "the discriminator, on training demonstrations", ("step", "AUROC", "ECE", "slope")
    return _by_snapshot(evaluation, title, columns, _health_in_training)


def _by_snapshot(
    evaluation: Mapping[str, Any],
    title: str,
    columns: Sequence[str],
    row: Callable[[Mapping[str, Any], int], list[Text]],
) -> Table | None:
    steps, health = lookup(evaluation, "drift.snapshots"), lookup(evaluation, "drift.health")
    if not isinstance(steps, list) or not isinstance(health, list):
        return None
    table = Table(box=box.SIMPLE_HEAD, title=_bold(title), title_justify="left")
    for name in columns:
        table.add_column(name, justify="right")
    for i, at in enumerate(steps):
        table.add_row(Text(f"{at:,}" if isinstance(at, int) else UNKNOWN), *row(evaluation, i))
    return table


DISTANCES = (
    "0 asks for the same, 1 for the opposite. own error: what the computation finds between the "
    "hand-written reward and itself with random shaping; a distance below it is not distinguishable. "
    "random: what it finds for a random network. The interval is over episodes."
)
DRIFT = (
    "to truth, moved: VAL distance to the hand-written reward (n.d.: not distinguishable) and from the "
    "snapshot before; shape: share of the mean squared change that is no offset or scale; turned: share of "
    "pairs of steps in the other order; bonus: survival bias, ±1 pays the same for every step; outside: "
    "share of fresh policy steps that lie where the probe has none, of which nothing here speaks."
)
HEALTH = (
    "AUROC: held-out expert, or training demonstrations where the title says so, against fresh policy steps, "
    "0.5 is blind; by heart: what training demonstrations have over held-out ones; JSD: nats, at least; ECE: "
    "how far D is from a probability; slope: 99th percentile of the logit's gradient."
)


def _moved(evaluation: Mapping[str, Any], i: int) -> list[Text]:
    drift, before = lookup(evaluation, "drift"), i - 1
    values = [
        (_item(drift, "speed", before), 3),
        (lookup(_item(drift, "moves", before), "shares.shape"), 2),
        (lookup(_item(drift, "shift", before), "pair_flips"), 2),
        (lookup(_item(drift, "hygiene", i), "survival_bias"), 2),
        (_item(drift, "outside", i), 2),
    ]
    return [_to_truth(_item(drift, "to_truth", i)), *(_text(value, digits) for value, digits in values)]


def _held_out(evaluation: Mapping[str, Any]) -> bool:
    rows = lookup(evaluation, "drift.health")
    return isinstance(rows, list) and any(lookup(row, "held_out") is not None for row in rows)


def _health(evaluation: Mapping[str, Any], i: int) -> list[Text]:
    keys = ("held_out.auroc", "memorised", "held_out.jsd_bound", "held_out.ece")
    return _of_health(evaluation, i, keys)


def _health_in_training(evaluation: Mapping[str, Any], i: int) -> list[Text]:
    return _of_health(evaluation, i, ("train.auroc", "train.ece"))


def _of_health(evaluation: Mapping[str, Any], i: int, keys: Sequence[str]) -> list[Text]:
    health = _item(lookup(evaluation, "drift"), "health", i)
    return [*(_text(lookup(health, key), 2) for key in keys), _text(lookup(health, "slope_p99"), 1)]


def _add(table: Table, name: str, row: object, grey: bool = False) -> None:
    style = GREY if grey else ""
    reason = lookup(row, "reason")
    if isinstance(reason, str):
        table.add_row(Text(name, style=style), Text("undefined", style=GREY), Text(reason, style=GREY))
        return
    told = lookup(row, "distinguishable") is not False
    value = _text(number(row, "value"), 3) if told else Text("not distinguishable", style=GREY)
    ends = number(row, "low"), number(row, "high")
    interval = UNKNOWN if ends[0] is None or ends[1] is None else f"{ends[0]:.3f}-{ends[1]:.3f}"
    rest = [_text(number(row, key), 3) for key in ("self_error", "random")]
    table.add_row(Text(name, style=style), value, Text(interval), *rest, style=style)


def _name(row: object) -> str:
    n, name = number(row, "n"), str(lookup(row, "name"))
    if n is None or name != "VAL":
        return name
    return f"{name}, whole episodes" if n == 0 else f"{name} over {n:.0f} steps"


def _title(evaluation: Mapping[str, Any]) -> str:
    steps, episodes = (number(evaluation, f"distances.{key}") or 0.0 for key in ("steps", "episodes"))
    digest = str(lookup(evaluation, "distances.probe_sha256"))[:12]
    return f"base probe {digest}, {steps:,.0f} steps of {episodes:,.0f} episodes"


def _drift_title(evaluation: Mapping[str, Any]) -> str:
    n, cycling = number(evaluation, "drift.n"), number(evaluation, "drift.cycling")
    moved = lookup(evaluation, "drift.normaliser.moved")
    parts = ["drift" if n is None else f"drift, over {n:.0f} steps"]
    parts += [] if cycling is None else [f"path {cycling:.1f} times the way from first to last"]
    parts += ["the normaliser moved too"] if moved is True else []
    return ", ".join(parts)


def _bold(title: str) -> Text:
    return Text(title, style="bold")


def _item(drift: object, key: str, i: int) -> Any:
    values = lookup(drift, key)
    return values[i] if isinstance(values, list) and 0 <= i < len(values) else None


def _to_truth(truth: object) -> Text:
    if lookup(truth, "distinguishable") is False:
        return Text("n.d.", style=GREY)
    return _text(number(truth, "value"), 3)


def _text(value: object, digits: int) -> Text:
    known = finite(value)
    return Text(UNKNOWN, style=GREY) if known is None else Text(f"{known:.{digits}f}")
