import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from irl.core.rng import stream
from irl.diagnostics.hexagons import HEIGHT, Comb, comb, count


def test_no_point_is_lost_and_each_lies_near_its_centre() -> None:
    x, y = stream(0, "hexagons").normal(size=(2, 3000))
    of = comb(x, y, 20)
    centres, counts = count(of, x, y)
    assert counts.sum() == 3000
    assert len(np.unique(centres, axis=0)) == len(centres)


@given(st.floats(0, 10), st.floats(0, 10 * HEIGHT))
def test_a_point_belongs_to_the_nearest_of_all_centres(x: float, y: float) -> None:
    # cells of width 1 and height sqrt(3): regular hexagons
    of = Comb((0.0, 10.0), (0.0, 10.0 * float(HEIGHT)), 10, 10)
    (mine,) = of.centres(of.cells(np.array([x]), np.array([y])))
    grid = np.array([(s, c, r) for s in (0, 1) for c in range(11) for r in range(11)])
    best = np.min(np.hypot(*(of.centres(grid) - [x, y]).T))
    assert np.hypot(mine[0] - x, mine[1] - y) <= best + 1e-9


def test_one_value_is_drawn_too() -> None:
    centres, counts = count(comb(np.ones(5), np.zeros(5), 8), np.ones(5), np.zeros(5))
    assert counts.tolist() == [5]
    assert np.all(np.isfinite(centres))
