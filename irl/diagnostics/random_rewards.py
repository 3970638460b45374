"""Rewards drawn at random, to test what a distance sees: shaping it should not, noise it should.

potential   Phi(s) = w . tanh(W_2 tanh(W_1 z + b_1)),   z the standardised observation
shaping     gamma (1 - terminated) Phi(s') - Phi(s),    scaled to a standard deviation
noise       the same network of (s, a), scaled alike
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.types import RewardFn, Transitions

WIDTH = 64


@dataclass(frozen=True, eq=False)
class Scaled:
    """A function of steps times a number."""

    of: Callable[[Transitions], np.ndarray]
    factor: float

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        return torch.from_numpy(self.factor * self.of(batch))


def shaping(batch: Transitions, gamma: float, std: float, rng: np.random.Generator) -> RewardFn:
    """Potential shaping with the standard deviation `std` on `batch`: it changes no optimal policy.

    Source: Ng, Harada & Russell (1999), Policy Invariance Under Reward Transformations.
    """
    potential = _network(batch.obs.double().numpy(), rng)

    def shaped(batch: Transitions) -> np.ndarray:
        now, ahead = batch.obs.double().numpy(), batch.next_obs.double().numpy()
        return gamma * potential(ahead) * ~batch.terminated.numpy() - potential(now)

    return _scaled(shaped, batch, std)


def noise(batch: Transitions, std: float, rng: np.random.Generator) -> RewardFn:
    """A random network's reward of (s, a), of the standard deviation `std` on `batch`."""

    def seen(batch: Transitions) -> np.ndarray:
        return torch.cat([batch.obs, batch.action], 1).double().numpy()

    network = _network(seen(batch), rng)
    return _scaled(lambda batch: network(seen(batch)), batch, std)


def _network(seen: Float[np.ndarray, "B I"], rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """A function of rows like `seen`, whose moments standardise them."""
    mean, std = np.mean(seen, axis=0), np.std(seen, axis=0)
    std = np.where(std > 0, std, 1.0)
    size = seen.shape[1]
    first, bias = rng.normal(0, size**-0.5, (size, WIDTH)), rng.normal(size=WIDTH)
    second, last = rng.normal(0, WIDTH**-0.5, (WIDTH, WIDTH)), rng.normal(0, WIDTH**-0.5, WIDTH)
    return lambda x: np.tanh(np.tanh((x - mean) / std @ first + bias) @ second) @ last


def _scaled(of: Callable[[Transitions], np.ndarray], batch: Transitions, std: float) -> Scaled:
    spread = float(np.std(of(batch)))
    return Scaled(of, std / spread if spread > 0 else 1.0)
