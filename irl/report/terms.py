"""The weights of the hand-written reward's terms as `irl evaluate` prints them."""

from collections.abc import Mapping
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from irl.report.folder import lookup, number
from irl.report.probed import GREY, UNKNOWN

TERMS = (
    "weight: in the learned reward's units for one of the term's, fitted together with a potential, whose "
    "shaping is taken off; 95 %: over episodes; moves: weight times the term's deviation over the learned "
    "reward's; share: of the learned reward's variance, on episodes left out of the fit."
)


def terms_table(evaluation: Mapping[str, Any]) -> Table | None:
    """A row a term, and what is left over; None where that was not measured."""
    weights = lookup(evaluation, "terms.weights")
    if not isinstance(weights, Mapping):
        return None
    table = Table(box=box.SIMPLE_HEAD, title=Text(_title(evaluation), style="bold"), title_justify="left")
    table.add_column("term of the hand-written reward")
    for name in ("weight", "95 %", "moves", "share"):
        table.add_column(name, justify="right", no_wrap=True)
    for name, row in weights.items():
        table.add_row(*_term(str(name), row))
    for name, key in (("a potential's shaping", "shaping"), ("all of it", "explained")):
        table.add_row(Text(name, style=GREY), "", "", "", _text(number(evaluation, f"terms.{key}")))
    return table


def _term(name: str, row: object) -> list[Text]:
    why_not = lookup(row, "why_not")
    share = _text(number(row, "share"))
    if isinstance(why_not, str):
        return [Text(f"{name}: {why_not}", style=GREY), *[Text("?", style=GREY)] * 3, share]
    low, high = number(row, "low"), number(row, "high")
    interval = UNKNOWN if low is None or high is None else f"{low:.3g} to {high:.3g}"
    return [
        Text(name),
        _text(number(row, "weight"), 3),
        Text(interval),
        _text(number(row, "standardised")),
        share,
    ]


def _title(evaluation: Mapping[str, Any]) -> str:
    bonus = number(evaluation, "terms.survival_bonus")
    found = "what it pays for"
    return found if bonus is None else f"{found}; a step that does not end the episode: {bonus:+.3g}"


def _text(value: float | None, digits: int = 2) -> Text:
    return Text(UNKNOWN, style=GREY) if value is None else Text(f"{value:.{digits}f}")
