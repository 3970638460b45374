"""Where a reward went from snapshot to snapshot, by what it asks for: offset, scale and shaping do not count.

speed(t)       VAL_n(r_t, r_(t-1))
to_final(t)    VAL_n(r_t, r_T)
cycling        sum of speeds / VAL_n(r_0, r_T)       1: straight there; large: round and round
flips(t)       share of segments whose G_n has the other sign than at t - 1
agreement(t)   share of segments with the sign of the true G_n, each at the weight of |true G_n|
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from irl.core import statistics
from irl.diagnostics.distance import LEFT, pearson_distance

NAN = float("nan")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """S snapshots of a reward."""

    matrix: Float[np.ndarray, "S S"]
    """Distance of every pair; NaN beside a snapshot of which nothing is left."""
    speed: tuple[float, ...]
    """Distance from the snapshot before; S - 1 numbers."""
    to_final: tuple[float, ...]
    cycling: float
    """NaN where the first and the last are one, for a reward that stood still does not cycle, and where a
    snapshot between has no distance."""
    map: Float[np.ndarray, "S 2"]
    """Places in a plane whose distances are nearest to those of `matrix` (classical scaling)."""
    flips: tuple[float, ...]
    agreement: tuple[float, ...]
    """NaN where there is no true reward."""


def trajectory(
    sums: Float[np.ndarray, "M S"], true: Float[np.ndarray, "M"], scale: Float[np.ndarray, "S"]
) -> Trajectory:
    """What moved among S snapshots.

    Args:
        sums: G_n of each snapshot on M segments.
        true: that of the hand-written reward.
        scale: largest raw reward of each snapshot: what is too small beside it is rounding.
    Cost: S^2 M.
    """
    n = sums.shape[1]
    left = [float(np.std(sums[:, i])) > LEFT * scale[i] for i in range(n)]
    matrix = np.full((n, n), NAN)
    for i in range(n):
        for j in range(i + 1):
            if left[i] and left[j]:
                matrix[i, j] = matrix[j, i] = 0.0 if i == j else pearson_distance(sums[:, i], sums[:, j])
    speed = [float(matrix[i - 1, i]) for i in range(1, n)]
    return Trajectory(
        matrix=matrix,
        speed=tuple(speed),
        to_final=tuple(matrix[:, -1].tolist()),
        cycling=cycling(speed, float(matrix[0, -1])),
        map=classical_scaling(matrix),
        flips=tuple(flips(sums[:, i - 1], sums[:, i]) for i in range(1, n)),
        agreement=tuple(agreement(sums[:, i], true) for i in range(n)),
    )


def cycling(speed: list[float], net: float) -> float:
    """Path length over net displacement; NaN where it came back to where it was or a part is unknown."""
    # NaN where a speed is: a way with a gap in it may have been of any length
    walked = math.fsum(speed)
    # below this, two distances are one rounding apart
    return walked / net if math.isfinite(net) and net > 1e-7 else NAN


def flips(before: Float[np.ndarray, "M"], after: Float[np.ndarray, "M"]) -> float:
    """Share of segments on which the sign of what is left of the reward changed."""
    return float(np.mean(np.sign(before) != np.sign(after))) if len(before) else NAN


def agreement(values: Float[np.ndarray, "M"], true: Float[np.ndarray, "M"]) -> float:
    """Share of segments with the true sign, weighted by how much the truth cares."""
    weight = np.abs(true)
    if not np.all(np.isfinite(weight)) or not np.sum(weight) > 0:
        return NAN
    return float(np.sum(weight * (np.sign(values) == np.sign(true))) / np.sum(weight))


def pair_flips(before: Float[np.ndarray, "N"], after: Float[np.ndarray, "N"]) -> float:
    """Share of pairs of steps in the other order than before: (1 - tau) / 2."""
    return (1.0 - statistics.kendall(before, after)) / 2.0


def classical_scaling(distances: Float[np.ndarray, "S S"]) -> Float[np.ndarray, "S 2"]:
    """Places in a plane for distances; NaN for a row without them.

    Source: Torgerson (1952), Multidimensional Scaling: I. Theory and Method.
    """
    known = np.isfinite(np.diag(distances))
    places = np.full((len(distances), 2), NAN)
    squares = distances[np.ix_(known, known)] ** 2
    if len(squares):
        centred = squares - squares.mean(0) - squares.mean(1)[:, None] + squares.mean()
        values, vectors = np.linalg.eigh(-centred / 2.0)
        largest = vectors[:, ::-1][:, :2] * np.sqrt(np.maximum(values[::-1][:2], 0.0))
        places[known] = np.pad(largest, ((0, 0), (0, 2 - largest.shape[1])))
    return places
