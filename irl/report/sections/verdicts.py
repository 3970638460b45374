"""The verdict strip: what the numbers say in one word each, with the number behind it."""

from collections.abc import Mapping
from html import escape
from typing import Any

from irl.diagnostics.verdicts import BY_NAME, WELCOME
from irl.report.folder import RunFiles, finite, lookup, number
from irl.report.palette import STRATA, STRATUM_NAMES
from irl.report.panel import Panel, Table, unmeasured
from irl.report.readings import key_numbers
from irl.report.verdict import state

LINKS = {
    "close": "map",
    "moved": "moved",
    "stable": "map",
    "flat": "fan",
    "collapsed": "policy",
    "saturated": "moved",
    "survival-biased": "terms",
    "misleading": "crossplay",
    "hacked": "gold",
}


def verdicts(run: RunFiles) -> Panel:
    """A card a verdict, and the key numbers."""
    anchor, title = "verdicts", "Verdicts"
    found = lookup(run.evaluation, "verdicts")
    rows = [row for row in found if isinstance(row, Mapping)] if isinstance(found, list) else []
    tables = _tables(run)
    if not rows and not tables:
        return unmeasured(run, anchor, title, "verdicts")
    text = (
        "One card a question: green is as it should be, orange is a warning, grey is not known. Thresholds "
        f"are conventions, not laws: read the number and follow the link to its section. {_whether(rows)}"
    )
    if not rows:
        text = f"{unmeasured(run, anchor, title, 'verdicts').text} The numbers that are known:"
    cards = "".join(_card(row) for row in rows)
    strip = f'<ul class="verdicts">{cards}</ul>' if cards else ""
    return Panel(
        anchor, title, text, "verdicts" if rows else "", tables=tables, notes=_chosen(run), html=strip
    )


_WORDS = {"good": "✓", "warning": "▲", "unknown": "?"}
_SPOKEN = {"good": "as it should be", "warning": "warning", "unknown": "not known"}


def _card(row: Mapping[str, Any]) -> str:
    name, how = str(row.get("name")), state(row)
    fired = {"good": "yes", "warning": "yes", "unknown": "not known"}[how] if row.get("fired") else "no"
    fired = "not known" if how == "unknown" else fired
    value, threshold = finite(row.get("value")), finite(row.get("threshold"))
    numbers = "" if value is None else f"<b>{value:.3g}</b>"
    numbers += "" if threshold is None else f" <span>{_bound(name)} {threshold:g}</span>"
    said = row.get("reason") if how == "unknown" and row.get("reason") else row.get("sentence")
    link = f'<a href="#{LINKS[name]}">look</a>' if name in LINKS else ""
    mark = f'<span class="mark" role="img" aria-label="{_SPOKEN[how]}">{_WORDS[how]}</span>'
    rule = f"<details><summary>rule</summary>{escape(str(row.get('rule') or ''))}</details>"
    return (
        f'<li class="{how}"><h3>{mark} {escape(name)}: {fired}</h3><p>{escape(str(said or ""))}</p>'
        f'<p class="number">{numbers} {link}</p>{rule}</li>'
    )


def _whether(rows: list[Mapping[str, Any]]) -> str:
    """Whose question that is: all green on a reward far from the hand-written one would mislead."""
    if any(row.get("name") == "close" for row in rows):
        return (
            "Only close says whether the reward asks for what the hand-written one does; the others are of "
            "the training."
        )
    return "None of them says whether the reward asks for what the hand-written one does."


def _bound(name: str) -> str:
    """On which side of the threshold a number is good or bad news."""
    rule = BY_NAME.get(name)
    if rule is None:
        return "threshold"
    return f"good {rule.side}" if name in WELCOME else f"warns {rule.side}"


def _chosen(run: RunFiles) -> tuple[str, ...]:
    step, rule = number(run.evaluation, "chosen.step"), lookup(run.evaluation, "chosen.rule")
    if step is None:
        return ()
    last = number(run.evaluation, "env_steps")
    same = "which is the last one" if step == last else "not the last one"
    return (
        f"Snapshot to use if one must be chosen without the hand-written reward: step {step:,.0f}, {same} "
        f"({rule}).",
    )


def _tables(run: RunFiles) -> tuple[Table, ...]:
    if not run.evaluation:
        return ()
    keys = [(row.name, row.value, row.reading) for row in key_numbers(run.evaluation)]
    tables = [Table(("measured", "value", "what it says"), keys, "Key numbers")]
    strata = lookup(run.evaluation, "reward.strata")
    if isinstance(strata, Mapping):
        names = ("mean", "std", "hand_written_mean", "pearson", "steps")
        rows = [(STRATUM_NAMES[name], *(number(strata, f"{name}.{key}") for key in names)) for name in STRATA]
        head = ("kind of play", "learned", "± std", "hand-written", "Pearson within", "steps")
        tables.append(Table(head, rows, "Mean reward of a step"))
    return tuple(tables)
