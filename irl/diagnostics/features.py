"""What a value function may be made of: the observation, its squares and random waves of it.

    phi(s) = [1, z, z^2, sqrt(2) cos(W z + b)],   z = (s - mean) / std,   W ~ N(0, 1 / O),   b ~ U(0, 2 pi)

One map for every reward that is compared, so that their value functions are errors of one kind.
MuJoCo's observations leave the position out, and so does this: with it, running forward would be shaping.

Source of the waves: Rahimi & Recht (2007), Random Features for Large-Scale Kernel Machines.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from irl.core.nets import MIN_STD

WAVES, STEPS_A_WAVE = 128, 50
"""Random waves at most, and how many steps there must be for each: a value function fitted to few steps with
many features is noise on other steps, and the same noise for every reward."""


@dataclass(frozen=True, eq=False)
class Features:
    """The map phi, with everything in it fixed."""

    mean: Float[np.ndarray, "O"]
    std: Float[np.ndarray, "O"]
    frequencies: Float[np.ndarray, "O W"]
    phases: Float[np.ndarray, "W"]

    @property
    def size(self) -> int:
        """How many numbers phi has."""
        return 1 + 2 * len(self.mean) + len(self.phases)

    def __call__(self, obs: Float[np.ndarray, "B O"]) -> Float[np.ndarray, "B F"]:
        # not clipped: a potential that is linear in the observation has to stay one of these
        z = (np.asarray(obs, dtype=np.float64) - self.mean) / self.std
        waves = math.sqrt(2.0) * np.cos(z @ self.frequencies + self.phases)
        return np.concatenate([np.ones((len(z), 1)), z, z**2, waves], axis=1)


def fitted(obs: Float[np.ndarray, "B O"], rng: np.random.Generator, waves: int | None = None) -> Features:
    """Features with the moments of `obs`; `rng` draws the waves, fewer where there are few steps."""
    if waves is None:
        waves = min(WAVES, len(obs) // STEPS_A_WAVE)
    seen = np.asarray(obs, dtype=np.float64)
    std = np.std(seen, axis=0)
    size = seen.shape[1]
    return Features(
        mean=np.mean(seen, axis=0),
        std=np.where(std < MIN_STD, 1.0, std),
        frequencies=rng.normal(0.0, 1.0 / math.sqrt(size), (size, waves)),
        phases=rng.uniform(0.0, 2.0 * math.pi, waves),
    )
