"""Numbers held against the bounds of a space."""

import numpy as np
from gymnasium.spaces import Box
from jaxtyping import Float

FLOAT32_UNITS = 8
"""How far beyond a bound a number may lie, in float32's units of the bound's last place."""


def action_outside(actions: Float[np.ndarray, "T A"], space: Box, taker: str) -> str | None:
    """The first action outside what `taker` takes, in words; None where there is none."""
    if (place := first_outside(actions, space)) is None:
        return None
    step, column = place
    return (
        f"the action {float(actions[place])!r} in column {column} at step {step}; {taker} takes "
        f"{space.low[column]:g} to {space.high[column]:g}; record actions as the environment gets them, "
        f"clipped"
    )


def first_outside(rows: Float[np.ndarray, "T D"], space: Box) -> tuple[int, int] | None:
    """Row and column of the first number outside the space, None where there is none."""
    low, high = space.low.astype(np.float64), space.high.astype(np.float64)
    # a bound as float32 is off by half a unit in the last place, an action scaled to it by a few
    largest = np.maximum(*(np.abs(np.where(np.isfinite(bound), bound, 0.0)) for bound in (low, high)))
    slack = FLOAT32_UNITS * np.finfo(np.float32).eps * largest
    outside = (rows < low - slack) | (rows > high + slack)
    if not outside.any():
        return None
    row, column = (int(i) for i in np.argwhere(outside)[0])
    return row, column
