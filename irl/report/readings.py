"""The key numbers of an evaluation, each with a sentence that says what it means.

The terminal table and the page show the same rows, so the words stand here once.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from irl.report.amounts import amount, percent, spread
from irl.report.folder import finite, lookup, number, why_missing

MISSING = "not known"


@dataclass(frozen=True)
class KeyNumber:
    """One row: what was measured, the number as a person reads it, and what it says."""

    name: str
    value: str
    reading: str


def key_numbers(evaluation: Mapping[str, Any]) -> list[KeyNumber]:
    """The rows of an evaluation, the policy first and then the reward."""
    return [
        _score(evaluation),
        _policy_return(evaluation),
        _length(evaluation),
        *(_reference(evaluation, name) for name in ("expert", "demonstrations", "random")),
        _correlation(evaluation, "step"),
        _correlation(evaluation, "episode"),
        _distance(evaluation),
        _auroc(evaluation),
        _last_change(evaluation),
    ]


def headline(evaluation: Mapping[str, Any]) -> str:
    """One sentence on the policy and one on the reward, of what is known."""
    score = number(evaluation, "policy.normalised_score")
    mean = number(evaluation, "policy.return_mean")
    pearson = number(evaluation, "reward.pearson")
    parts = []
    if score is not None:
        parts.append(f"The policy gets {percent(score)} of the way from a random policy to the expert.")
    elif mean is not None:
        parts.append(f"The policy returns {amount(mean)} an episode.")
    # step by step shaping counts, so where the distance that forgives it is known it is said instead
    if pearson is not None and number(evaluation, "distances.headline.value") is None:
        parts.append(f"Step by step, the learned reward {_agreement(pearson)} (Pearson {pearson:.2f}).")
    if not parts:
        reason = why_missing(evaluation, "policy.return_mean").rstrip(".")
        parts = [reason[:1].upper() + reason[1:] + "."]
    return " ".join(parts)


def _missing(evaluation: Mapping[str, Any], name: str, path: str) -> KeyNumber:
    return KeyNumber(name, MISSING, f"Reason: {why_missing(evaluation, path).rstrip('.')}.")


def _score(evaluation: Mapping[str, Any]) -> KeyNumber:
    name, path = "Normalised score", "policy.normalised_score"
    score = number(evaluation, path)
    if score is None:
        return _missing(evaluation, name, path)
    ends = [number(evaluation, f"references.{who}.return_mean") for who in ("random", "expert")]
    low, high = ["" if end is None else f" (return {amount(end)})" for end in ends]
    return KeyNumber(name, f"{score:.3f}", f"0 is a random policy{low}, 1 is the expert{high}.")


def _policy_return(evaluation: Mapping[str, Any]) -> KeyNumber:
    name, path = "Return of the policy", "policy.return_mean"
    mean = number(evaluation, path)
    if mean is None:
        return _missing(evaluation, name, path)
    low, high = number(evaluation, "policy.return_min"), number(evaluation, "policy.return_max")
    episodes = number(evaluation, "policy.episodes")
    over = "over the evaluation episodes" if episodes is None else f"over {episodes:.0f} episodes"
    ends = "" if low is None or high is None else f"; the worst {amount(low)}, the best {amount(high)}"
    value = spread(mean, number(evaluation, "policy.return_std"))
    return KeyNumber(name, value, f"Mean ± standard deviation {over} of the deterministic policy{ends}.")


def _length(evaluation: Mapping[str, Any]) -> KeyNumber:
    name, path = "Episode length", "policy.length_mean"
    mean, shortest = number(evaluation, path), number(evaluation, "policy.length_min")
    if mean is None:
        return _missing(evaluation, name, path)
    reading = "Mean over the same episodes" + (
        "." if shortest is None else f"; the shortest had {shortest:,.0f}."
    )
    return KeyNumber(name, f"{mean:,.0f} steps", reading)


def _reference(evaluation: Mapping[str, Any], who: str) -> KeyNumber:
    name = {"expert": "Return of the expert", "random": "Return of a random policy"}.get(
        who, "Return of the demonstrations"
    )
    path = f"references.{who}"
    mean = number(evaluation, f"{path}.return_mean")
    if mean is None:
        return _missing(evaluation, name, path)
    episodes, source = number(evaluation, f"{path}.episodes"), lookup(evaluation, f"{path}.source")
    over = (
        "" if episodes is None else f"{episodes:.0f} episode{'s' * (episodes != 1)} that were learned from. "
    )
    reading = over + (f"Source: {source}." if source else "")
    return KeyNumber(name, spread(mean, number(evaluation, f"{path}.return_std")), reading)


def _correlation(evaluation: Mapping[str, Any], unit: str) -> KeyNumber:
    prefix = "reward." if unit == "step" else "reward.episode_"
    name, path = f"Agreement per {unit}", f"{prefix}pearson"
    pearson, spearman = number(evaluation, path), number(evaluation, f"{prefix}spearman")
    if pearson is None:
        return _missing(evaluation, name, path)
    value = f"r = {pearson:.2f}" + ("" if spearman is None else f", ρ = {spearman:.2f}")
    count = number(evaluation, f"reward.{unit}s")
    over = "" if count is None else f", over {count:,.0f} {unit}s of expert, policy and random play"
    what = "reward" if unit == "step" else "sum of the learned reward"
    reading = f"Pearson's r and Spearman's ρ{over}: the learned {what} {_agreement(pearson)}"
    reading = reading.replace("the learned sum of the", "the sum of the")
    within = number(evaluation, "reward.strata.policy.pearson") if unit == "step" else None
    but = "" if within is None else f"; within the policy's own steps r = {within:.2f}"
    # judge.py: over all strata a correlation is mostly their order
    easy = "over several kinds of play that is mostly their order, which is easy"
    return KeyNumber(name, value, f"{reading}; {easy}{but}.")


def _agreement(correlation: float) -> str:
    size = abs(correlation)
    if size < 0.2:
        return "has next to nothing to do with the hand-written one"
    if correlation < 0:
        return f"{'runs' if size >= 0.4 else 'leans'} against the hand-written one"
    strength = "closely" if size >= 0.9 else "well" if size >= 0.7 else "in part" if size >= 0.4 else "weakly"
    return f"agrees {strength} with the hand-written one"


def _distance(evaluation: Mapping[str, Any]) -> KeyNumber:
    name, path = "Distance to the hand-written reward", "distances.headline"
    value, low, high = (number(evaluation, f"{path}.{key}") for key in ("value", "low", "high"))
    if value is None:
        return _missing(evaluation, name, path)
    shown = f"{value:.3f}" if low is None or high is None else f"{value:.3f} ({low:.3f} to {high:.3f})"
    ends = (("own error", "self_error"), ("a random network", "random"))
    known = [
        f"{words} {n:.3f}" for words, key in ends if (n := number(evaluation, f"{path}.{key}")) is not None
    ]
    return KeyNumber(name, shown, "; ".join(["VAL: 0 is the same, 1 the opposite", *known]) + ".")


def _auroc(evaluation: Mapping[str, Any]) -> KeyNumber:
    name, path = "AUROC, expert against policy", "reward.auroc"
    auroc = number(evaluation, path)
    if auroc is None:
        return _missing(evaluation, name, path)
    return KeyNumber(
        name,
        f"{auroc:.2f}",
        f"In {percent(auroc)} of pairs the expert's step has the higher logit (of AIRL: f) than the "
        "policy's; 50 % means that it cannot tell them apart, which is where good imitation leads.",
    )


def _last_change(evaluation: Mapping[str, Any]) -> KeyNumber:
    name, path = "Last move of the reward", "drift.changes"
    last, (start, end) = _last_move(evaluation)
    shape, total = number(last, "shape"), number(last, "total")
    if shape is None or total is None or start is None or end is None:
        return _missing(evaluation, name, path)
    if total <= 0:
        return KeyNumber(name, "0", f"The reward stood still between steps {start:,.0f} and {end:,.0f}.")
    return KeyNumber(
        name,
        f"{percent(shape / total)} shape",
        f"Of a mean squared change of {amount(total)} between steps {start:,.0f} and {end:,.0f}; "
        "only shape changes which steps are preferred.",
    )


def _last_move(evaluation: Mapping[str, Any]) -> tuple[object, tuple[float | None, float | None]]:
    """The last change, of the base probe where that was read, and the steps it lies between."""
    moves, at = lookup(evaluation, "drift.moves"), lookup(evaluation, "drift.snapshots")
    if isinstance(moves, list) and moves and isinstance(at, list) and len(at) == len(moves) + 1:
        return moves[-1], (finite(at[-2]), finite(at[-1]))
    changes = lookup(evaluation, "drift.changes")
    last = changes[-1] if isinstance(changes, list) and changes else None
    return last, (number(last, "from"), number(last, "to"))
