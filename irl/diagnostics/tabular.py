"""The canonical forms of rewards on a finite MDP, exact: a reward is an array R[s, a, s'].

What the sampled distances are held against, and of use by themselves where a task is small. T[s, a, s'] is
the probability of s' after a in s, pi[s, a] that of a in s.
"""

import numpy as np
from jaxtyping import Float


def epic(
    reward: Float[np.ndarray, "S A S"],
    states: Float[np.ndarray, "S"],
    actions: Float[np.ndarray, "A"],
    gamma: float,
) -> Float[np.ndarray, "S A S"]:
    """C(R)(s, a, s') = R + gamma m(s') - m(s) - gamma E[m(S)],   m(x) = E[R(x, A, S')].

    Args:
        states: distribution of S and of S'.
        actions: distribution of A.
    Source: Gleave et al. (2021), arXiv:2006.13900.
    """
    mean = np.einsum("sat,a,t->s", reward, actions, states)
    return reward + gamma * mean[None, None, :] - mean[:, None, None] - gamma * states @ mean


def dard(
    reward: Float[np.ndarray, "S A S"],
    dynamics: Float[np.ndarray, "S A S"],
    actions: Float[np.ndarray, "A"],
    gamma: float,
) -> Float[np.ndarray, "S A S"]:
    """T(R)(s, a, s') = R + E[gamma R(s', A, S'') - R(s, A, S') - gamma R(S', A, S'')].

    Source: Wulfe et al. (2022), arXiv:2201.10081.
    """
    mean = np.einsum("sat,sat,a->s", reward, dynamics, actions)
    # S' from s and S'' from s', under the same action
    between = np.einsum("a,sau,tav,uav->st", actions, dynamics, dynamics, reward, optimize=True)
    return reward + gamma * mean[None, None, :] - mean[:, None, None] - gamma * between[:, None, :]


def val(
    reward: Float[np.ndarray, "S A S"],
    dynamics: Float[np.ndarray, "S A S"],
    policy: Float[np.ndarray, "S A"],
    gamma: float,
) -> Float[np.ndarray, "S A S"]:
    """STARC's VAL: c(R)(s, a, s') = E_T[R(s, a, S') - V(s) + gamma V(S')], the same for every s'.

    V is the value of `policy` under R, V = (I - gamma P)^-1 r.
    Source: Skalse et al. (2024), arXiv:2309.15257.
    """
    expected = np.einsum("sat,sat->sa", reward, dynamics)
    value = values(expected, dynamics, policy, gamma)
    left = expected - value[:, None] + gamma * dynamics @ value
    return np.broadcast_to(left[:, :, None], reward.shape).copy()


def values(
    reward: Float[np.ndarray, "S A"],
    dynamics: Float[np.ndarray, "S A S"],
    policy: Float[np.ndarray, "S A"],
    gamma: float,
) -> Float[np.ndarray, "S"]:
    """V = (I - gamma P)^-1 r, with P[s, s'] = sum_a pi T and r[s] = sum_a pi R."""
    steps = np.einsum("sa,sat->st", policy, dynamics)
    return np.linalg.solve(np.eye(len(steps)) - gamma * steps, np.sum(policy * reward, axis=1))


def starc(a: Float[np.ndarray, "..."], b: Float[np.ndarray, "..."]) -> float:
    """|a / |a| - b / |b|| of two canonical rewards in the Euclidean norm, in [0, 2]; NaN where one is 0.

    Twice the Pearson distance, without the centring.
    Source: Skalse et al. (2024), arXiv:2309.15257, which takes 0 for a reward that is 0.
    """
    sizes = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    if min(sizes) == 0.0:
        return float("nan")
    return float(np.linalg.norm(a / sizes[0] - b / sizes[1]))
