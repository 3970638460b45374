"""What the page comes to, in a few sentences at its top: may the reward be trusted, and why not."""

from collections.abc import Mapping

from irl.diagnostics.verdicts import BY_NAME, WELCOME
from irl.report.amounts import percent
from irl.report.folder import RunFiles, finite, lookup, number, texts
from irl.report.readings import headline
from irl.report.verdict import state

CLOSE, PARTLY = BY_NAME["close"].threshold, 0.3
"""Distances below which two rewards are called close, or alike in part; a convention of this page."""
NEAR_RANDOM = 0.75
"""Share of a random reward's distance above which a reward is little better than one."""
FURTHER = 0.05
"""By how much the last distance has to exceed an earlier one to be said: less is the probe's noise."""
NOTHING = 0.005
"""A share that is written as 0 %."""


def summary(run: RunFiles) -> list[str]:
    """Sentences on policy, reward, the order of policies, retraining and coverage, of what is known."""
    found = [_policy(run)] if run.evaluation or not run.metrics else []
    parts = (_distance, _nearest, _terms, _order, _cannot, _outside, _warnings, _retrained)
    for sentence in (part(run) for part in parts):
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


def _policy(run: RunFiles) -> str:
    """The headline, with what it is of: one seed is one draw, however many episodes it played."""
    said, episodes = headline(run.evaluation), number(run.evaluation, "policy.episodes")
    known = number(run.evaluation, "policy.return_mean") is not None and episodes is not None
    return f"{said} That is {episodes:.0f} episodes of one training seed." if known else said


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
        f"Forgiving shaping, the distance of the learned reward to the hand-written one{over} is {value:.2f}"
        f"{within}, where 0 is the same, 1 the opposite{other}: {closeness(value, error, random)}."
    )


def _nearest(run: RunFiles) -> str:
    """Where the reward was nearer before, which is no rare thing: it says less the better the policy."""
    at, rows = lookup(run.evaluation, "drift.snapshots"), lookup(run.evaluation, "drift.to_truth")
    if not isinstance(at, list) or not isinstance(rows, list):
        return ""
    pairs = [(number(row, "value"), finite(step)) for step, row in zip(at, rows, strict=False)]
    known = [(value, step) for value, step in pairs if value is not None and step is not None]
    if not known or min(known)[0] >= known[-1][0] - FURTHER:
        return ""
    value, step = min(known)
    return f"It was nearer before ({value:.2f} at step {step:,.0f}) and has gone away from it since."


def _terms(run: RunFiles) -> str:
    """What it pays for, by the share of its variance, and what it pays for the other way round."""
    weights, explained = lookup(run.evaluation, "terms.weights"), number(run.evaluation, "terms.explained")
    if not isinstance(weights, Mapping) or explained is None:
        return ""
    rows = [(number(row, "share") or 0.0, str(name), _sign(row)) for name, row in weights.items()]
    paid = ", ".join(f"{name} {percent(n)}{sign}" for n, name, sign in sorted(rows, reverse=True) if n > 0)
    shaping = number(run.evaluation, "terms.shaping")
    paid += f", a potential's shaping {percent(shaping)}" if paid and shaping and shaping >= NOTHING else ""
    rest = percent(max(0.0, 1 - explained))
    return f"What it pays for, of its variance: {paid or 'no term'}; {rest} is nothing the hand-written has."


def _sign(row: object) -> str:
    """What a share, which has no sign, leaves out of its term's weight."""
    weight, low, high = (number(row, key) for key in ("weight", "low", "high"))
    said = "" if weight is None or weight >= 0 else " with the opposite sign"
    if low is not None and high is not None and low <= 0 <= high:
        said = " with a sign that is not known"
    return said + (" (a weight that is not identifiable)" if lookup(row, "why_not") else "")


def _cannot(run: RunFiles) -> str:
    lines = texts(lookup(run.evaluation, "ledger.cannot"))
    return f"No reward of this kind can say {lines[0]}." if lines else ""


def _order(run: RunFiles) -> str:
    rows = lookup(run.evaluation, "cross_play.agreement")
    last = rows[-1] if isinstance(rows, list) and rows else None
    tau = finite(lookup(last, "kendall.value"))
    if tau is None:
        return ""
    return f"It puts {percent((1 + tau) / 2)} of pairs of policies in their true order (chance: 50 %)."


def _retrained(run: RunFiles) -> str:
    """Of the learned reward where it was learned: neither of the control nor of other dynamics."""
    rows = run.retrained.get("rows")
    found = [row for row in rows if isinstance(row, Mapping)] if isinstance(rows, list) else []
    learned = [row for row in found if row.get("part") != "hand-written"]
    here = [row for row in learned if row.get("dynamics") == "as trained"]
    ratios = [finite(lookup(row, "ratio.value")) for row in here]
    known = [ratio for ratio in ratios if ratio is not None]
    if here and not known:
        return f"Of fresh policies on the frozen reward there is no ratio: {here[-1].get('ratio_reason')}."
    if not known:
        tested = run.retrain or not run.evaluation
        untested = "Whether a fresh policy learns the task from it is not known: irl retrain tries that."
        return "" if tested else untested
    least = f"{percent(min(known))}{' or more' if len(known) > 1 else ''}"
    way = "of the way from random actions to the policy beside it"
    return f"Fresh policies on the frozen reward get {least} {way}, by the interquartile mean of their seeds."


def _outside(run: RunFiles) -> str:
    outside = lookup(run.evaluation, "drift.outside")
    last = finite(outside[-1]) if isinstance(outside, list) and outside else None
    if last is None:
        return ""
    if last < NOTHING:
        return ""
    return f"Of {percent(last)} of the policy's own steps nothing here speaks: they lie outside the probe."


def _warnings(run: RunFiles) -> str:
    found = lookup(run.evaluation, "verdicts")
    rows = [row for row in found if isinstance(row, Mapping)] if isinstance(found, list) else []
    bad = [row for row in rows if state(row) == "warning"]
    said = [f"not {row.get('name')}" if row.get("name") in WELCOME else str(row.get("name")) for row in bad]
    return f"Warnings: {', '.join(said)}." if said else ""
