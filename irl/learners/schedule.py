"""Learning rates over a run."""

from collections.abc import Callable
from typing import Literal


def learning_rate(lr: float, schedule: Literal["constant", "linear"]) -> float | Callable[[float], float]:
    """What SB3 takes: a number, or a function of the share of the run that remains.

    >>> learning_rate(0.5, "linear")(0.5)
    0.25
    """
    return lr if schedule == "constant" else lambda remaining: lr * remaining
