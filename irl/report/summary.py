"""What the page comes to, in a few sentences at its top: may the reward be trusted, and why not."""

from collections.abc import Mapping

from irl.report.folder import RunFiles, finite, lookup, number
from irl.report.readings import headline, percent

CLOSE, PARTLY = 0.15, 0.3
"""Distances below which two rewards are called close, or alike in part; a convention of this page."""
NEAR_RANDOM = 0.75
"""Share of a random reward's distance above which a reward is little better than one."""


def summary(run: RunFiles) -> list[str]:
    """Sentences on policy, reward, the order of policies, retraining and coverage, of what is known."""
    found = [headline(run.evaluation)] if run.evaluation or not run.metrics else []
    for sentence in (_distance(run), _order(run), _retrained(run), _outside(run), _warnings(run)):
        if sentence:
            found.append(sentence)
    if not run.evaluation and run.metrics:
        found.append("The reward of this run was not judged yet: irl evaluate does that.")
    return found


def closeness(value: float, own_error: float | None, random: float | None) -> str:
    """A distance in words."""
    if own_error is not None and value <= own_error:
        return "it cannot be told from the hand-written one"
    if random is not None and value >= NEAR_RANDOM * random:
        return "that is little nearer than a random network"
    return "that is close" if value < CLOSE else "that is alike in part" if value < PARTLY else "that is far"


def _distance(run: RunFiles) -> str:
    path = "distances.headline"
    value, low, high = (number(run.evaluation, f"{path}.{key}") for key in ("value", "low", "high"))
    error, random, n = (number(run.evaluation, f"{path}.{key}") for key in ("self_error", "random", "n"))
    if value is None:
        return ""
    within = "" if low is None or high is None else f" ({low:.2f} to {high:.2f})"
    other = "" if random is None else f", a random network {random:.2f}"
    over = "" if n is None else f" over {n:.0f} steps"
    return (
        f"Forgiving shaping, its distance to the hand-written reward{over} is {value:.2f}{within}, where 0 "
        f"is the same, 1 the opposite{other}: {closeness(value, error, random)}."
    )


def _order(run: RunFiles) -> str:
    rows = lookup(run.evaluation, "cross_play.agreement")
    last = rows[-1] if isinstance(rows, list) and rows else None
    tau = finite(lookup(last, "kendall.value"))
    if tau is None:
        return ""
    return f"It puts {percent((1 + tau) / 2)} of pairs of policies in their true order."


def _retrained(run: RunFiles) -> str:
    rows = run.retrained.get("rows")
    ratios = [finite(lookup(row, "ratio.value")) for row in rows] if isinstance(rows, list) else []
    known = [ratio for ratio in ratios if ratio is not None]
    if not known:
        return "" if run.retrain else "No policy was retrained on it, the strongest test there is."
    return f"Fresh policies on the frozen reward reach {percent(min(known))} or more of the return beside it."


def _outside(run: RunFiles) -> str:
    outside = lookup(run.evaluation, "drift.outside")
    last = finite(outside[-1]) if isinstance(outside, list) and outside else None
    if last is None:
        return ""
    return f"Of {percent(last)} of the policy's own steps nothing here speaks: they lie outside the probe."


def _warnings(run: RunFiles) -> str:
    rows = lookup(run.evaluation, "verdicts")
    fired = [
        str(row.get("name"))
        for row in (rows if isinstance(rows, list) else ())
        if isinstance(row, Mapping) and row.get("fired") is True and row.get("name") != "stable"
    ]
    return f"Warnings: {', '.join(fired)}." if fired else ""
