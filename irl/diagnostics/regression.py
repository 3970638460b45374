"""Least squares over episodes, from one Gram matrix an episode.

    b  =  argmin |y - X b|^2 + lambda |b_penalised|^2

Every sum over steps that a fit, a held-out error or a bootstrap needs is a sum of these matrices: drawing
episodes again, or leaving some out, never touches a step.
"""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

Matrix = Float[np.ndarray, "P P"]


def grams(
    designs: Sequence[Float[np.ndarray, "_ Q"]], targets: Sequence[Float[np.ndarray, "_"]]
) -> Float[np.ndarray, "E P P"]:
    """Of each episode [X y]' [X y], with P = Q + 1: the target is the last column."""
    joined = [np.column_stack([x, y]).astype(np.float64) for x, y in zip(designs, targets, strict=True)]
    return np.stack([of_one.T @ of_one for of_one in joined])


def solve(
    gram: Matrix, columns: Sequence[int], penalised: Sequence[int], ridge: float
) -> Float[np.ndarray, "P1"]:
    """Coefficients of all columns but the target; 0 for those that are not in `columns`.

    The penalty is `ridge` times the mean square of each penalised column, so units do not matter.
    """
    kept = np.asarray(columns, dtype=int)
    inner = gram[np.ix_(kept, kept)].copy()
    scale = np.sqrt(np.maximum(np.diag(inner), np.finfo(float).tiny))
    # columns of one length: a term of 1e-4 beside one of 3 would otherwise drown in rounding
    inner /= np.outer(scale, scale)
    inner[np.diag_indices(len(kept))] += np.where(np.isin(kept, penalised), ridge, 0.0)
    right = gram[kept, -1] / scale
    found = np.zeros(len(gram) - 1)
    found[kept] = np.linalg.lstsq(inner, right, rcond=1e-12)[0] / scale
    return found


def squared_error(gram: Matrix, coefficients: Float[np.ndarray, "P1"]) -> float:
    """Sum of (y - X b)^2."""
    b = np.append(-coefficients, 1.0)
    return float(b @ gram @ b)


def r2(
    of_episodes: Float[np.ndarray, "E P P"],
    columns: Sequence[int],
    penalised: Sequence[int],
    ridge: float,
    folds: int = 5,
) -> float:
    """Share of the target's variance that is explained on episodes left out of the fit, in (-inf, 1].

    The mean that the errors are held against is the fit's too: column 0 is the intercept. Cost: a fit for
    each fold.
    """
    folds = min(folds, len(of_episodes))
    whole, error, spread = of_episodes.sum(0), 0.0, 0.0
    for fold in range(folds):
        left_out = of_episodes[fold::folds].sum(0)
        error += squared_error(left_out, solve(whole - left_out, columns, penalised, ridge))
        spread += squared_error(left_out, solve(whole - left_out, [0], [], ridge))
    return 1.0 - error / spread if spread > 0.0 else float("nan")


def redrawn(
    of_episodes: np.ndarray,
    columns: Sequence[int],
    penalised: Sequence[int],
    ridge: float,
    counts: Int[np.ndarray, "R E"],
) -> Float[np.ndarray, "R Q"]:
    """The fit to each of R resamples, by how often each episode is in it (`bootstrap.within`)."""
    drawn = np.tensordot(counts.astype(np.float64), of_episodes, 1)
    return np.stack([solve(gram, columns, penalised, ridge) for gram in drawn])


def shapley(
    of_episodes: np.ndarray, k: int, potential: Sequence[int], ridge: float
) -> tuple[Float[np.ndarray, "K1"], float]:
    """Each term's share of the variance explained on episodes left out, the potential's last; their sum."""
    players = [[1 + i] for i in range(k)] + [list(potential)]
    n = len(players)
    worth = {
        chosen: r2(of_episodes, [0, *itertools.chain(*(players[i] for i in chosen))], potential, ridge)
        for size in range(n + 1)
        for chosen in itertools.combinations(range(n), size)
    }
    shares = np.zeros(n)
    for chosen, value in worth.items():
        for i in set(range(n)) - set(chosen):
            often = math.factorial(len(chosen)) * math.factorial(n - len(chosen) - 1) / math.factorial(n)
            shares[i] += often * (worth[tuple(sorted((*chosen, i)))] - value)
    return shares, worth[tuple(range(n))]


def unexplained(gram: np.ndarray, column: int, others: Sequence[int]) -> float:
    """Share of a column's variance that the others do not explain."""
    # the column once more, in the place of the target
    order = [*range(len(gram) - 1), column]
    with_target = gram[np.ix_(order, order)]
    spread = squared_error(with_target, solve(with_target, [0], [], 0.0))
    left = squared_error(with_target, solve(with_target, others, [], 0.0))
    return max(left / spread, 0.0) if spread > 0.0 else 0.0


def condition(whole: np.ndarray, k: int, potential: Sequence[int]) -> float:
    """Of the terms' correlations, with the offset and the potential taken off."""
    terms, rest = list(range(1, 1 + k)), [0, *potential]
    if not terms:
        return math.nan
    cross = whole[np.ix_(rest, terms)]
    inner = whole[np.ix_(rest, rest)]
    left = whole[np.ix_(terms, terms)] - cross.T @ np.linalg.lstsq(inner, cross, rcond=1e-12)[0]
    scale = np.sqrt(np.maximum(np.diag(left), np.finfo(float).tiny))
    return float(np.linalg.cond(left / np.outer(scale, scale)))
