"""Each verdict fires on a planted number and is silent on that of a healthy run."""

import math

import pytest

from irl.diagnostics.verdicts import NAMES, RULES, WELCOME, verdicts

HEALTHY = {
    "close": 0.06,
    "moved": 0.02,
    "stable": 0.02,
    "flat": 1.1,
    "collapsed": 0.0,
    "saturated": 0.05,
    "survival-biased": 0.45,
    "misleading": 0.0,
    "hacked": 0.05,
}
SICK = {
    "close": 0.44,
    "moved": 0.4,
    "stable": 0.3,
    "flat": 1e-3,
    "collapsed": 0.9,
    "saturated": 0.97,
    "survival-biased": 0.93,
    "misleading": 0.98,
    "hacked": 0.6,
}


def test_there_are_nine_and_each_has_a_case() -> None:
    assert set(NAMES) == set(HEALTHY) == set(SICK)
    assert len(NAMES) == len(RULES) == 9


@pytest.mark.parametrize("name", NAMES)
def test_it_fires_on_its_planted_case_alone(name: str) -> None:
    # being close and being at rest are the good verdicts
    healthy = {v.name: v for v in verdicts(HEALTHY)}
    assert healthy[name].fired == (name in WELCOME)
    planted = {v.name: v for v in verdicts(HEALTHY | {name: SICK[name]})}
    assert planted[name].fired == (name not in WELCOME)
    assert planted[name].sentence != healthy[name].sentence
    others = [other for other in NAMES if other != name]
    assert all(planted[other] == healthy[other] for other in others)
    assert planted[name].value == SICK[name]
    assert planted[name].reason is None


@pytest.mark.parametrize("value", [None, math.nan])
def test_what_is_not_known_is_not_judged_and_says_why(value: float | None) -> None:
    found = verdicts({"hacked": value}, {"hacked": "the true return is not known"})
    hacked = found[NAMES.index("hacked")]
    assert (hacked.fired, hacked.value) == (None, None)
    assert hacked.reason == "the true return is not known"
    assert "the true return is not known" in hacked.sentence
    assert all(v.fired is None and v.reason for v in found)
