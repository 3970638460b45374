"""Rewards drawn at random, to test what a distance sees: shaping it should not, noise it should.

    potential   Phi(s) = w . tanh(W_2 tanh(W_1 z + b_1)),   z the standardised observation
    shaping     gamma (1 - terminated) Phi(s') - Phi(s),    scaled to a standard deviation
    noise       the same network of (s, a), scaled alike
"""

import numpy as np
from jaxtyping import Float

from irl.core.types import Transitions

WIDTH = 64


def shaping(
    batch: Transitions, gamma: float, std: float, rng: np.random.Generator
) -> Float[np.ndarray, "B"]:
    """Potential shaping of standard deviation `std`: it changes no optimal policy.

    Source: Ng, Harada & Russell (1999), Policy Invariance Under Reward Transformations.
    """
    now, ahead = (np.asarray(x.double().numpy()) for x in (batch.obs, batch.next_obs))
    potential = _network(now, rng)
    values = gamma * potential(ahead) * ~batch.terminated.numpy() - potential(now)
    return _scaled(values, std)


def noise(batch: Transitions, std: float, rng: np.random.Generator) -> Float[np.ndarray, "B"]:
    """A random network's reward of (s, a), of standard deviation `std`."""
    seen = np.concatenate([batch.obs.double().numpy(), batch.action.double().numpy()], axis=1)
    return _scaled(_network(seen, rng)(seen), std)


def _network(seen: Float[np.ndarray, "B I"], rng: np.random.Generator):
    """A function of rows like `seen`, whose moments standardise them."""
    mean, std = np.mean(seen, axis=0), np.std(seen, axis=0)
    std = np.where(std > 0, std, 1.0)
    size = seen.shape[1]
    first, bias = rng.normal(0, size**-0.5, (size, WIDTH)), rng.normal(size=WIDTH)
    second, last = rng.normal(0, WIDTH**-0.5, (WIDTH, WIDTH)), rng.normal(0, WIDTH**-0.5, WIDTH)
    return lambda x: np.tanh(np.tanh((x - mean) / std @ first + bias) @ second) @ last


def _scaled(values: Float[np.ndarray, "B"], std: float) -> Float[np.ndarray, "B"]:
    spread = float(np.std(values))
    return values * (std / spread) if spread > 0 else values
