"""Small finite MDPs as arrays, and their steps as a stack."""

import numpy as np
import torch

from irl.core.types import Episode, Transitions
from irl.diagnostics.stack import Stack, stack

GAMMA = 0.9


def dynamics(rng: np.random.Generator, states: int, actions: int, sharp: float = 1.0) -> np.ndarray:
    """T[s, a, s'], rows drawn from a Dirichlet: the smaller `sharp`, the nearer to deterministic."""
    return rng.dirichlet(np.full(states, sharp), (states, actions))


def shaped(reward: np.ndarray, potential: np.ndarray, gamma: float = GAMMA) -> np.ndarray:
    return reward + gamma * potential[None, None, :] - potential[:, None, None]


def optimal(reward: np.ndarray, t: np.ndarray, gamma: float = GAMMA) -> np.ndarray:
    """The policy, one-hot, that value iteration finds for R[s, a, s']."""
    expected = np.einsum("sat,sat->sa", reward, t)
    value = np.zeros(len(t))
    for _ in range(400):
        value = np.max(expected + gamma * t @ value, axis=1)
    return np.eye(t.shape[1])[np.argmax(expected + gamma * t @ value, axis=1)]


def every_step(t: np.ndarray) -> Stack:
    """Each (s, a) once, with the one next state it leads to, in one-hot observations; twice over.

    Two episodes, so that each half of a cross-fit holds every step.
    """
    states, actions = t.shape[:2]
    s, a = (x.ravel() for x in np.meshgrid(np.arange(states), np.arange(actions), indexing="ij"))
    after = np.argmax(t[s, a], axis=1)
    one, choice = np.eye(states, dtype=np.float32), np.eye(actions, dtype=np.float32)
    half = Episode(one[np.append(s, 0)], choice[a], np.zeros(len(s)), False, True)
    made = stack({"all": [half, half]})
    flags = torch.zeros(2 * len(s), dtype=torch.bool)
    doubled = [torch.from_numpy(np.tile(x, (2, 1))) for x in (one[s], choice[a], one[after])]
    return Stack(Transitions(doubled[0], doubled[1], doubled[2], flags, flags), made.layout)


def of_table(reward: np.ndarray):
    """A `RewardFn` of one-hot states and actions."""

    def read(batch: Transitions) -> torch.Tensor:
        index = [x.argmax(1).numpy() for x in (batch.obs, batch.action, batch.next_obs)]
        return torch.from_numpy(reward[index[0], index[1], index[2]])

    return read
