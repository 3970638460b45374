"""What is left of a reward when a value function is taken off it: temporal-difference errors.

    delta(t) = r(t) + gamma V(s') - V(s),   V(s) = phi(s) . w,   V = 0 after a termination
    A w = P^T r,   A = P^T (P - gamma P'),   P = phi(s),   P' = (1 - terminated) phi(s')

w is the least-squares fixed point: V is the value of r under the policies that made the steps. It is linear
in r, so delta of a r + b r' is a delta + b delta', and of a potential's shaping in the span of phi it is 0.
Features that say the same make A singular; it is solved in three steps

    w <- w + (A + lambda N I)^-1 (P^T r - A w)

which leave out what is smaller than lambda and are exact to rounding for the rest.
The weights used on one half of the episodes are fitted to the other, or noise would be fitted away.

Source of w: Bradtke & Barto (1996), Linear Least-Squares Algorithms for Temporal Difference Learning.
Of taking V off to compare rewards: Skalse et al. (2024), arXiv:2309.15257.
"""

from collections.abc import Callable, Iterator

import numpy as np
from jaxtyping import Float
from scipy.linalg import lu_factor, lu_solve

from irl.diagnostics.stack import Stack

RIDGE = 1e-8
"""Lambda, for features of size 1."""
SOLVES = 3
ROWS = 8192
"""Steps whose features are held at a time."""

FeatureMap = Callable[[np.ndarray], np.ndarray]


def td_errors(
    rewards: Float[np.ndarray, "N R"],
    steps: Stack,
    features: FeatureMap,
    gamma: float,
    ridge: float = RIDGE,
) -> Float[np.ndarray, "N R"]:
    """The delta of each of R rewards on every step, each half of the episodes with the other's weights.

    With fewer than two episodes the same steps give weights and errors.

    Raises:
        ValueError: the rewards are of other steps, or gamma is not in [0, 1).
    Cost: two passes over the features and one F x F solve a half, shared by all rewards.
    """
    if len(rewards) != len(steps.batch) or not 0.0 <= gamma < 1.0:
        raise ValueError(f"{len(rewards)} rewards of {len(steps.batch)} steps at gamma = {gamma}")
    fold = steps.layout.fold[steps.layout.episode]
    halves = sorted(set(fold.tolist()))
    rewards = _anchored(rewards, steps, gamma)
    weights = {half: _weights(rewards, steps, fold == half, features, gamma, ridge) for half in halves}
    errors = np.empty(rewards.shape, dtype=np.float64)
    for half in halves:
        rows = np.flatnonzero(fold == half)
        other = weights[1 - half] if len(halves) == 2 else weights[half]
        for part, now, ahead in in_parts(steps, rows, features):
            errors[part] = rewards[part] + (gamma * ahead - now) @ other
    return errors


def _anchored(rewards: Float[np.ndarray, "N R"], steps: Stack, gamma: float) -> Float[np.ndarray, "N R"]:
    """The rewards with the constant potential on them that takes their mean off.

        r + gamma (1 - terminated) k - k,   k = mean of r / (1 - gamma)

    Shaping, so that delta stays what it is; but exact, where the solve would leave some of a large offset.
    """
    ended = steps.batch.terminated.numpy()[:, None]
    mean = np.mean(rewards, axis=0, where=~ended) if not ended.all() else np.zeros(rewards.shape[1])
    return rewards - mean * np.where(ended, 1.0 / (1.0 - gamma), 1.0)


def _weights(
    rewards: Float[np.ndarray, "N R"],
    steps: Stack,
    chosen: np.ndarray,
    features: FeatureMap,
    gamma: float,
    ridge: float,
) -> Float[np.ndarray, "F R"]:
    rows = np.flatnonzero(chosen)
    left, right = np.zeros((1, 1)), np.zeros((1, 1))
    for part, now, ahead in in_parts(steps, rows, features):
        left = left + now.T @ (now - gamma * ahead)
        right = right + now.T @ rewards[part]
    factors = lu_factor(left + ridge * len(rows) * np.eye(len(left)))
    weights = np.zeros_like(right)
    for _ in range(SOLVES):
        weights = weights + lu_solve(factors, right - left @ weights)
    return weights


def in_parts(
    steps: Stack, rows: np.ndarray, features: FeatureMap
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Row numbers, P and P' of `rows`, not too many at a time."""
    batch = steps.batch
    for start in range(0, len(rows), ROWS):
        part = rows[start : start + ROWS]
        now, ahead = features(batch.obs[part].numpy()), features(batch.next_obs[part].numpy())
        yield part, now, ahead * ~batch.terminated[part].numpy()[:, None]
