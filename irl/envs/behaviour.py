"""A policy as demonstrations may need it: drawn from its distribution, with noise, at random now and then.

    a = policy(s), its mode               or a draw from its own distribution
    a <- a + noise * N(0, I)              in environment units; the rollout clips to the bounds
    a <- uniform within the bounds        with probability `random`, at each step anew

Every episode has streams of its own, so it is the same whatever is played before it or beside it.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import gymnasium as gym
import numpy as np
from jaxtyping import Float

from irl.core.errors import UserError
from irl.core.rng import stream
from irl.core.types import ActFn
from irl.envs.discrete import OneHot
from irl.envs.rollouts import random_act


@runtime_checkable
class Samples(Protocol):
    """A policy with a distribution of actions."""

    def sample(self, obs: Float[np.ndarray, "O"], rng: np.random.Generator) -> np.ndarray: ...


@dataclass(frozen=True)
class Behaviour:
    """How a policy's actions are changed; none of it by default."""

    stochastic: bool = False
    """Draw from the policy's own distribution."""
    noise: float = 0.0
    """Standard deviation of Gaussian noise, environment units."""
    random: float = 0.0
    """Probability that an action is uniformly random instead."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.noise < np.inf:
            raise ValueError(
                f"action noise must be a finite standard deviation of 0 or more, not {self.noise}"
            )
        if not 0.0 <= self.random <= 1.0:
            raise ValueError(f"random actions must have a probability of 0 to 1, not {self.random}")


def behaving(act: ActFn, how: Behaviour, space: gym.Space, seed: int, episode: int) -> ActFn:
    """`act` as it behaves in one episode.

    Args:
        seed: of the streams.
        episode: what tells the episode's streams from those of others, its reset seed.

    Raises:
        UserError: it is to be drawn from and has no distribution, or noise is for a choice of actions.
    """
    # a policy that can be asked for draws may still have nothing to draw from
    if how.stochastic and not (isinstance(act, Samples) and getattr(act, "draws", True)):
        raise UserError("this policy has no distribution to draw actions from; leave --stochastic away")
    if how.noise and isinstance(space, OneHot):
        raise UserError(f"noise has no meaning for {space}, a choice of actions; --random-actions has")
    drawn, noisy, replaced = (
        stream(seed, f"behaviour/{episode}/{part}") for part in ("draw", "noise", "random")
    )
    uniform = random_act(space, replaced)

    def behave(obs: Float[np.ndarray, "O"]) -> np.ndarray:
        if how.random and replaced.random() < how.random:
            return uniform(obs)
        action = act.sample(obs, drawn) if how.stochastic and isinstance(act, Samples) else act(obs)
        return action + how.noise * noisy.standard_normal(np.shape(action)) if how.noise else action

    return act if how == Behaviour() else behave
