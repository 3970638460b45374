"""Episodes of the point mass by kind of play, and rewards of them."""

from collections.abc import Callable

import numpy as np
import torch

from irl.core.rng import stream
from irl.core.types import Episode, Transitions
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollouts
from tests import pointmass


def play(n: int = 8, cliff: int = 0) -> dict[str, list[Episode]]:
    """`n` episodes each of the expert and of random actions, and `cliff` that can end early."""
    env = make("PointMass-v0")
    act = random_act(env.action_space, stream(0, "walks"))
    strata = {"expert": pointmass.demonstrations(n), "random": rollouts("PointMass-v0", act, range(n))}
    return strata | ({"cliff": rollouts("Cliff-v0", act, range(cliff))} if cliff else {})


def true(batch: Transitions) -> torch.Tensor:
    """The task's own reward, computed."""
    return -batch.next_obs.double().norm(dim=1)


def shaped(by: float) -> Callable[[Transitions], np.ndarray]:
    """The task's own with a linear and a square potential."""

    def potential(obs: torch.Tensor) -> np.ndarray:
        x = obs.double().numpy()
        return by * (x[:, 0] - x[:, 1] ** 2)

    def reward(batch: Transitions) -> np.ndarray:
        kept = ~batch.terminated.numpy()
        return true(batch).numpy() + 0.99 * kept * potential(batch.next_obs) - potential(batch.obs)

    return reward


def mirage(batch: Transitions) -> torch.Tensor:
    """The truth at the origin, where the expert is nearly always, and the opposite elsewhere."""
    own = true(batch)
    return torch.where(own > -0.3, own, -own - 0.6)
