"""Learning rates and other weights over a run."""

from collections.abc import Callable
from typing import Literal


def learning_rate(lr: float, schedule: Literal["constant", "linear"]) -> float | Callable[[float], float]:
    """What SB3 takes: a number, or a function of the share of the run that remains.

    The last round may go past the run's steps; SB3 then calls what remains negative.

    >>> rate = learning_rate(0.5, "linear")
    >>> rate(0.5), rate(-0.1)
    (0.25, 0.0)
    """
    return lr if schedule == "constant" else lambda remaining: lr * max(remaining, 0.0)


def rate_at(lr: float, schedule: Literal["constant", "linear"], remaining: float) -> float:
    """The rate when that share of the run remains."""
    rate = learning_rate(lr, schedule)
    return rate(remaining) if callable(rate) else rate
