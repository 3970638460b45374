"""How a learned reward agrees with the hand-written one: step by step, and episode by episode.

Both are correlations, so an offset and a positive scale do not count against the learned reward;
shaping does, step by step, and much less in the sums over episodes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from irl.core import statistics


@dataclass(frozen=True)
class Agreement:
    """Two correlations over `n` steps or episodes; NaN, with a reason, where they are undefined."""

    pearson: float
    """Linear, in [-1, 1]."""
    spearman: float
    """Of the ranks, in [-1, 1]."""
    n: int
    """How many steps or episodes were compared."""
    reason: str | None = None
    """Why both are NaN; None where they are numbers."""


def per_step(learned: Float[np.ndarray, "N"], hand_written: Float[np.ndarray, "N"]) -> Agreement:
    """Agreement over a stack of steps.

    Raises:
        ValueError: the two differ in length.
    """
    if len(learned) != len(hand_written):
        raise ValueError(f"expected two rewards of the same steps: {len(learned)} != {len(hand_written)}")
    return _agreement(learned, hand_written, noun="reward", unit="steps")


def per_episode(
    learned: Sequence[Float[np.ndarray, "_"]], hand_written: Sequence[Float[np.ndarray, "_"]]
) -> Agreement:
    """Agreement of the undiscounted sums over episodes, one array of step rewards an episode.

    Raises:
        ValueError: the two differ in the number of episodes, or in the length of one.
    """
    ours, theirs = [len(rewards) for rewards in learned], [len(rewards) for rewards in hand_written]
    if ours != theirs:
        raise ValueError(f"expected two rewards of the same episodes: lengths {ours} != {theirs}")
    sums = [np.array([np.sum(r, dtype=np.float64) for r in rewards]) for rewards in (learned, hand_written)]
    return _agreement(sums[0], sums[1], noun="return", unit="episodes")


def _agreement(
    learned: Float[np.ndarray, "N"], hand_written: Float[np.ndarray, "N"], noun: str, unit: str
) -> Agreement:
    reason = _undefined(learned, hand_written, noun, unit)
    if reason is not None:
        return Agreement(float("nan"), float("nan"), len(learned), reason)
    return Agreement(
        statistics.pearson(learned, hand_written),
        statistics.spearman(learned, hand_written),
        len(learned),
    )


def _undefined(
    learned: Float[np.ndarray, "N"], hand_written: Float[np.ndarray, "N"], noun: str, unit: str
) -> str | None:
    if len(learned) < 2:
        return f"a correlation needs two {unit} or more, there are {len(learned)}"
    named = {f"the hand-written {noun}": hand_written, f"the learned {noun}": learned}
    for name, values in named.items():
        if not np.all(np.isfinite(values)):
            return (
                f"{name} is not finite on {int(np.sum(~np.isfinite(values)))} of these {len(values)} {unit}"
            )
        if statistics.is_constant(values):
            return f"{name} is constant on these {unit}"
    return None
