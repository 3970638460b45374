"""What else a learned reward pays for: a nonlinear model of what the terms and a potential leave over.

    e           =  r - c - sum_k w_k T_k - shaping       each step by a fit to other episodes (terms)
    e           ~  ridge on [1, z, z^2, cos(W z + b)],  z of (s, a, s' - s)        (features)
    R^2         =  1 - |e - fit|^2 / |e - mean|^2                   on episodes that the model has not seen
    importance  =  R^2 - R^2 with one column of those episodes in another order

Random waves and a ridge, where trees would ask for one more dependency: both find a smooth function of a few
numbers, and what neither finds is left unnamed. Columns that say much the same share their importance, or
have none: each can be put out of order while the other still tells.

Source of permutation importance: Breiman (2001), Random Forests.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from irl.core.statistics import is_constant
from irl.core.types import Episode
from irl.diagnostics.features import Features, fitted
from irl.diagnostics.regression import grams, solve
from irl.diagnostics.shaping import design, moments
from irl.diagnostics.terms import names_of

FOLDS = 5
RIDGE = 1e-2
MOST = 6000
"""Steps, evenly spaced, that importance is measured on."""


@dataclass(frozen=True)
class Residual:
    """What a model of (s, a, s' - s) finds in what is left over."""

    r2: float
    """Of what the terms and the potential leave over."""
    share: float
    """Of the learned reward's variance, that which is left over."""
    importance: dict[str, float]
    """By name of the column, the largest first."""


def residual(
    episodes: Sequence[Episode],
    learned: Sequence[Float[np.ndarray, "_"]],
    *,
    gamma: float,
    rng: np.random.Generator,
    ridge: float = 1e-3,
) -> Residual:
    """The nonlinear rest of the reward `learned` of the episodes' steps.

    Args:
        rng: draws the waves and the orders.
        ridge: of the potential, as in `terms.attribute`.
    Raises:
        ValueError: there are fewer than 5 episodes, they have no terms in common, or the learned reward is
            constant, of other steps or not finite.
    Cost: an evaluation of the waves for each column, on `MOST` steps.
    """
    names = names_of(episodes, learned)
    if len(episodes) < FOLDS:
        raise ValueError(f"a model is tried on episodes left out; {len(episodes)} are fewer than {FOLDS}")
    reward = np.concatenate(learned)
    if is_constant(reward):
        raise ValueError("the learned reward is constant here")
    fold = np.repeat(np.arange(len(episodes)) % FOLDS, [len(episode) for episode in episodes])
    left = _left_over(episodes, learned, names, gamma, ridge)
    columns, x = seen(episodes)
    features = fitted(x, rng)
    weights = _weights(features, x, left, fold)
    share = float(np.var(left) / np.var(reward))
    some = np.linspace(0, len(x) - 1, min(MOST, len(x))).astype(int)
    r2, importance = _importance(features, weights, x[some], left[some], fold[some], rng)
    ordered = sorted(zip(columns, importance.tolist(), strict=True), key=lambda pair: -pair[1])
    return Residual(r2, share, dict(ordered))


def seen(episodes: Sequence[Episode]) -> tuple[list[str], Float[np.ndarray, "N I"]]:
    """The columns of (s, a, s' - s) by name, on every step."""
    obs = np.concatenate([episode.obs[:-1] for episode in episodes])
    change = np.concatenate([np.diff(episode.obs, axis=0) for episode in episodes])
    action = np.concatenate([episode.action for episode in episodes])
    parts = {"obs[{}]": obs, "action[{}]": action, "change of obs[{}]": change}
    names = [name.format(i) for name, part in parts.items() for i in range(part.shape[1])]
    return names, np.column_stack(list(parts.values())).astype(np.float64)


def _left_over(
    episodes: Sequence[Episode],
    learned: Sequence[np.ndarray],
    names: Sequence[str],
    gamma: float,
    ridge: float,
) -> Float[np.ndarray, "N"]:
    """What the linear fit to the other folds leaves of each step."""
    mean, std = moments(episodes)
    designs = [design(episode, names, gamma, mean, std) for episode in episodes]
    of_episodes = grams(designs, learned)
    whole, every = of_episodes.sum(0), range(designs[0].shape[1])
    potential = range(1 + len(names), designs[0].shape[1])
    found = [solve(whole - of_episodes[k::FOLDS].sum(0), every, potential, ridge) for k in range(FOLDS)]
    return np.concatenate(
        [r - x @ found[i % FOLDS] for i, (x, r) in enumerate(zip(designs, learned, strict=True))]
    )


def _weights(
    features: Features, x: np.ndarray, left: np.ndarray, fold: Int[np.ndarray, "N"]
) -> list[np.ndarray]:
    """Of each fold, the ridge fitted to the others."""
    of_folds = [grams([features(x[fold == k])], [left[fold == k]])[0] for k in range(FOLDS)]
    whole, every = np.sum(of_folds, axis=0), range(features.size)
    return [solve(whole - of_fold, every, range(1, features.size), RIDGE) for of_fold in of_folds]


def _importance(
    features: Features,
    weights: Sequence[np.ndarray],
    x: np.ndarray,
    left: np.ndarray,
    fold: Int[np.ndarray, "M"],
    rng: np.random.Generator,
) -> tuple[float, Float[np.ndarray, "I"]]:
    """R^2 on the folds left out, and what of it each column carries."""
    rows = [np.flatnonzero(fold == k) for k in range(FOLDS)]
    spread = sum(float(np.sum((left[r] - left[fold != k].mean()) ** 2)) for k, r in enumerate(rows))
    if spread == 0.0:
        raise ValueError("nothing is left over")
    orders = [rng.permutation(r) for r in rows]

    def r2(column: int | None) -> float:
        error = 0.0
        for k, r in enumerate(rows):
            given = x[r].copy()
            if column is not None:
                given[:, column] = x[orders[k], column]
            error += float(np.sum((left[r] - features(given) @ weights[k]) ** 2))
        return 1.0 - error / spread

    whole = r2(None)
    return whole, np.array([whole - r2(column) for column in range(x.shape[1])])
