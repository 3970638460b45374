import numpy as np
import pytest

from irl.report import seeds


@pytest.mark.parametrize(
    ("values", "mean"),
    [
        ([1.0], 1.0),
        ([0.0, 4.0], 2.0),
        ([9.0, 1.0, 0.0, 2.0], 1.5),
        ([0.0, 1.0, 100.0], (1.0 / 3 + 100 / 12 + 0) / 0.5),
    ],
)
def test_the_middle_half_counts(values: list[float], mean: float) -> None:
    # of three values each covers a third: the outer two count with a twelfth each
    assert float(seeds.iqm(np.array(values))) == pytest.approx(mean)


def test_one_seed_has_no_interval() -> None:
    assert seeds.interval([0.5]) is None


def test_an_interval_holds_the_values_it_is_drawn_from() -> None:
    found = seeds.interval([0.2, 0.4, 0.6, 0.8, 1.0])
    assert found is not None
    assert 0.2 <= found[0] < 0.6 < found[1] <= 1.0
