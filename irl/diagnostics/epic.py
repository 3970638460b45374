"""EPIC, a named reference: potentials are averaged away over states and actions drawn on their own.

    C(R)(s, a, s') = R(s, a, s') + E[gamma R(s', A, S') - R(s, A, S') - gamma R(S, A, S')]
    D_EPIC(R, R') = D(C(R), C(R')),   S, S' ~ D_S and A ~ D_A independent

The expectations are means over one set of M pairs (a_j, s_j), whose states double as those of S: shared by
every term, they take a potential off exactly, however few they are.

It asks for the reward of steps that no simulator makes, (s, a, S') with S' from anywhere, so the reward has
to be a function of (s, a, s'): the hand-written ones of MuJoCo are not, their form in velocities is
(`irl.rewards.velocity`). It knows no end of an episode: every step is taken as one that goes on.

Source: Gleave et al. (2021), arXiv:2006.13900.
"""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float

from irl.core.types import Transitions
from irl.diagnostics.stack import Given, read

ROWS = 65_536
"""Invented steps that the reward is asked for at a time."""


def canonical(
    reward: Given, batch: Transitions, samples: Transitions, gamma: float
) -> Float[np.ndarray, "B"]:
    """C(R) of each step of `batch`.

    Args:
        reward: of (s, a, s') alone.
        samples: M steps, whose actions are the a_j and whose observations the s_j.
        gamma: discount per step.
    Cost: (2 B + M) M rewards.
    """
    own = read(reward, going_on(batch))
    ahead = mean_reward(reward, batch.next_obs, samples)
    now = mean_reward(reward, batch.obs, samples)
    anywhere = mean_reward(reward, samples.obs, samples)
    return own + gamma * ahead - now - gamma * float(np.mean(anywhere))


def mean_reward(
    reward: Given, states: Float[torch.Tensor, "B O"], samples: Transitions
) -> Float[np.ndarray, "B"]:
    """1/M sum over j of R(x, a_j, s_j), for each state x."""
    m = len(samples)
    at_once = max(1, ROWS // m)
    means = [_means(reward, states[i : i + at_once], samples) for i in range(0, len(states), at_once)]
    return np.concatenate(means)


def _means(reward: Given, states: Float[torch.Tensor, "C O"], samples: Transitions) -> Float[np.ndarray, "C"]:
    n, m = len(states), len(samples)
    flags = torch.zeros(n * m, dtype=torch.bool)
    invented = Transitions(
        states.repeat_interleave(m, 0),
        samples.action.repeat(n, 1),
        samples.obs.repeat(n, 1),
        flags,
        flags,
    )
    return read(reward, invented, ROWS).reshape(n, m).mean(1)


def going_on(batch: Transitions) -> Transitions:
    """The batch with no end in it, and without the recorded reward, which is of these steps alone."""
    never = torch.zeros_like(batch.terminated)
    return replace(batch, terminated=never, truncated=never, reward=None, terms={})
