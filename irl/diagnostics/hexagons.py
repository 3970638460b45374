"""How many points lie in each hexagon of a honeycomb, for a picture of thousands of steps.

The centres are two rectangular lattices, one shifted by half a cell; a point belongs to the nearer of its
two nearest centres.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

HEIGHT = np.sqrt(3.0)
"""Of a cell of the lattice over its width, where hexagons are regular."""


@dataclass(frozen=True, eq=False)
class Comb:
    """Where the cells lie: `across` of them over the width."""

    x: tuple[float, float]
    y: tuple[float, float]
    across: int
    up: int

    def centres(self, cell: Int[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 2"]:
        """The centre of each cell (lattice, column, row)."""
        width, height = self._size()
        column, row = cell[:, 1] + 0.5 * cell[:, 0], cell[:, 2] + 0.5 * cell[:, 0]
        return np.column_stack([self.x[0] + column * width, self.y[0] + row * height])

    def cells(self, x: Float[np.ndarray, "N"], y: Float[np.ndarray, "N"]) -> Int[np.ndarray, "N 3"]:
        """Lattice, column and row of the cell that each point lies in; points outside go to the edge."""
        width, height = self._size()
        u, v = (np.clip(x, *self.x) - self.x[0]) / width, (np.clip(y, *self.y) - self.y[0]) / height
        even = np.column_stack([np.rint(u), np.rint(v)])
        odd = np.column_stack([np.floor(u), np.floor(v)])
        near = (u - even[:, 0]) ** 2 + 3.0 * (v - even[:, 1]) ** 2
        far = (u - odd[:, 0] - 0.5) ** 2 + 3.0 * (v - odd[:, 1] - 0.5) ** 2
        second = far < near
        place = np.where(second[:, None], odd, even)
        return np.column_stack([second, place]).astype(np.int64)

    def _size(self) -> tuple[float, float]:
        return (self.x[1] - self.x[0]) / self.across, (self.y[1] - self.y[0]) / self.up


def comb(x: Float[np.ndarray, "N"], y: Float[np.ndarray, "N"], across: int, aspect: float = 0.6) -> Comb:
    """A honeycomb over all but the outermost thousandth of the points, `across` cells wide.

    Args:
        aspect: height of the picture over its width.
    """
    up = max(1, round(across * aspect / HEIGHT))
    return Comb(_range(x), _range(y), across, up)


def count(
    of: Comb, x: Float[np.ndarray, "N"], y: Float[np.ndarray, "N"]
) -> tuple[Float[np.ndarray, "C 2"], Int[np.ndarray, "C"]]:
    """The centres of the cells that hold a point, and how many each holds."""
    cells, counts = np.unique(of.cells(x, y), axis=0, return_counts=True)
    return of.centres(cells), counts


def _range(values: Float[np.ndarray, "N"]) -> tuple[float, float]:
    low, high = np.quantile(values, [0.0005, 0.9995])
    return (float(low), float(high)) if high > low else (float(low) - 0.5, float(low) + 0.5)
