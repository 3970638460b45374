"""Why a return has no score is said as it is."""

import math

import pytest

from irl.experiment.references import NO_REFERENCE, NO_RETURN, NO_SCALE, why_unscored


@pytest.mark.parametrize(
    ("returned", "random", "expert", "reason"),
    [
        (math.nan, 0.0, 1.0, NO_RETURN),
        (5.0, None, 1.0, NO_REFERENCE),
        (5.0, 0.0, None, NO_REFERENCE),
        (5.0, 5.0, 5.0, NO_SCALE),
    ],
)
def test_the_reason_is_the_one_there_is(
    returned: float, random: float | None, expert: float | None, reason: str
) -> None:
    assert why_unscored(returned, random, expert) == reason
