"""What is the matter with a reward: one table of rules, each a number against a threshold.

A rule says what it takes, when it fires and what that means; a number that is not known is not judged, and
says why. Thresholds are ours: round numbers beyond what short runs of GAIL, AIRL and DAC on Hopper have, not
calibrated on many.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Rule:
    """One verdict."""

    name: str
    threshold: float
    above: bool
    """Whether it fires above the threshold, or below."""
    rule: str
    """In words."""
    means: str
    """Where it fires."""
    silent: str
    """Where it does not."""

    @property
    def side(self) -> str:
        """Where a number has to lie for it to fire."""
        return "above" if self.above else "below"


@dataclass(frozen=True)
class Verdict:
    """A rule applied."""

    name: str
    fired: bool | None
    """None where it was not judged."""
    value: float | None
    threshold: float
    rule: str
    sentence: str
    reason: str | None
    """Why it was not judged."""


RULES: tuple[Rule, ...] = (
    Rule(
        "close",
        0.15,
        False,
        "distance (VAL) of the last reward to the hand-written one, which is 0 for the same and 1 for the "
        "opposite, is below the threshold",
        "It asks for nearly what the hand-written reward asks for, on the play that it was held against.",
        "It asks for what the hand-written reward asks for in part, or not at all: it is no substitute for "
        "it, whatever the other verdicts say.",
    ),
    Rule(
        "moved",
        0.2,
        True,
        "distance (VAL) of the last reward to that halfway through the run is above the threshold",
        "Half the run ago the reward asked for something else; a policy trained on the last one alone is "
        "trained on another reward than this policy was.",
        "What the reward asks for has changed little since halfway through the run.",
    ),
    Rule(
        "stable",
        0.05,
        False,
        "largest distance (VAL) of the last reward to those of the last quarter is below the threshold",
        "The reward has come to rest.",
        "The reward is still on its way: a snapshot is one of many.",
    ),
    Rule(
        "flat",
        0.05,
        False,
        "standard deviation of the reward over the probe, in its own units (nats), is below the threshold",
        "It pays nearly the same for everything: nothing can be learned from it.",
        "It tells steps apart.",
    ),
    Rule(
        "collapsed",
        0.5,
        True,
        "share of its true return above random actions that the policy lost again, where the learned return "
        "fell with it, is above the threshold",
        "The policy has lost most of what it had learned, and the reward saw it: the training fell over, and "
        "an earlier snapshot is better.",
        "The policy has not lost that much while the learned return fell.",
    ),
    Rule(
        "saturated",
        0.5,
        True,
        "share of expert and policy steps with a logit beyond 5 is above the threshold",
        "The discriminator is sure of nearly every step: where it is sure it has no slope, and the reward "
        "does not say which way is better.",
        "The discriminator leaves room for better and worse.",
    ),
    Rule(
        "survival-biased",
        0.8,
        True,
        "|mean| / (|mean| + deviation) of the reward over the probe, where episodes can end early and "
        "the hand-written reward is below the threshold, is above it",
        "Going on, or ending, pays more than how: a policy may learn to do no more than that.",
        "How a step is done pays, beside that it is done.",
    ),
    Rule(
        "misleading",
        0.2,
        True,
        "top-1 regret of the last reward in cross-play (0 where the policy that it pays most is the best, 1 "
        "where it is the worst) is above the threshold",
        "The policy that it pays most is a poor one by the hand-written reward: whoever looks for more of "
        "it, and can find that policy, ends there.",
        "The policy that it pays most is the best of those that were played, or nearly.",
    ),
    Rule(
        "hacked",
        0.2,
        True,
        "share of its true return above random actions that the policy lost again, where the learned return "
        "rose meanwhile, is above the threshold",
        "The policy gets more of the learned reward and less of the true one: the reward is being exploited.",
        "The true return did not fall that much while the learned one rose.",
    ),
)
"""Every verdict there is."""

NAMES = tuple(rule.name for rule in RULES)
WELCOME = ("close", "stable")
"""Those that are good news where they fire; the others are warnings."""
BY_NAME = {rule.name: rule for rule in RULES}


def verdicts(
    numbers: Mapping[str, float | None], reasons: Mapping[str, str] | None = None
) -> tuple[Verdict, ...]:
    """Every rule applied to its number, by name; one that is not there is not judged.

    Args:
        reasons: why a number is not there.
    """
    return tuple(_judged(rule, numbers.get(rule.name), (reasons or {}).get(rule.name)) for rule in RULES)


def _judged(rule: Rule, value: float | None, reason: str | None) -> Verdict:
    if value is None or not math.isfinite(value):
        why = reason or "the number is not known"
        return Verdict(rule.name, None, None, rule.threshold, rule.rule, f"Not judged: {why}.", why)
    fired = value > rule.threshold if rule.above else value < rule.threshold
    said = rule.means if fired else rule.silent
    return Verdict(rule.name, fired, value, rule.threshold, rule.rule, said, None)
