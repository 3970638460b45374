"""Policies made worse on purpose: what a reward says off the expert's path is seen only where something goes.

box      a + level * half the range of the actions * N(0, 1)
choice   with probability `level` a choice at random
"""

import numpy as np
from gymnasium.spaces import Box
from jaxtyping import Float

from irl.core.types import ActFn
from irl.envs.discrete import OneHot
from irl.envs.rollouts import random_act


def noised(act: ActFn, space: Box, level: float, rng: np.random.Generator) -> ActFn:
    """`act` with noise of `level`, drawn from `rng`; bounds are the environment's business."""
    if isinstance(space, OneHot):
        anything = random_act(space, rng)
        return lambda obs: anything(obs) if rng.random() < level else act(obs)
    half = (space.high.astype(np.float64) - space.low) / 2.0

    def worse(obs: Float[np.ndarray, "O"]) -> Float[np.ndarray, "A"]:
        return act(obs) + level * half * rng.standard_normal(len(half))

    return worse
