import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from irl.core.rng import stream
from irl.diagnostics.drift import split

reward = st.one_of(st.just(0.0), st.floats(1e-6, 1e6), st.floats(-1e6, -1e-6))


def _sum(parts) -> float:
    return parts.offset + parts.scale + parts.shape


@given(arrays(np.float64, (2, 9), elements=reward))
def test_the_parts_add_up_to_the_total(pair) -> None:
    parts = split(pair[0], pair[1])
    assert _sum(parts) == pytest.approx(parts.total, rel=1e-10)
    assert min(parts.offset, parts.scale, parts.shape) >= 0


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("mean", [0.0, 3.0])
def test_a_small_change_of_a_large_reward_keeps_its_digits(size: float, mean: float) -> None:
    a, b = stream(2, "test").normal(size=(2, 5000))
    parts = split(mean + a, mean + a + size * b)
    assert _sum(parts) == pytest.approx(parts.total, rel=1e-10)


def test_each_part_is_what_the_equation_says() -> None:
    a, b = stream(3, "test").normal(size=(2, 400))
    before, after = 1 + a, 3 + 0.5 * a + b
    sigma_s, sigma_t, rho = np.std(before), np.std(after), np.corrcoef(before, after)[0, 1]
    parts = split(before, after)
    assert parts.offset == pytest.approx((np.mean(after) - np.mean(before)) ** 2, rel=1e-12)
    assert parts.scale == pytest.approx((sigma_t - sigma_s) ** 2, rel=1e-11)
    assert parts.shape == pytest.approx(2 * sigma_t * sigma_s * (1 - rho), rel=1e-11)


def test_a_shift_is_all_offset_a_stretch_all_scale_a_shuffle_all_shape() -> None:
    r = stream(4, "test").normal(size=1000)
    r = r - np.mean(r)
    assert split(r, r + 2).shares == pytest.approx({"offset": 1, "scale": 0, "shape": 0}, abs=1e-12)
    assert split(r, 2 * r).shares == pytest.approx({"offset": 0, "scale": 1, "shape": 0}, abs=1e-12)
    assert split(r, np.roll(r, 1)).shares == pytest.approx({"offset": 0, "scale": 0, "shape": 1}, abs=1e-12)


def test_a_constant_reward_has_no_shape() -> None:
    r = stream(5, "test").normal(size=100)
    for before, after in [(np.full(100, 0.1), r), (r, np.full(100, 0.1))]:
        parts = split(before, after)
        assert parts.shape == 0
        assert _sum(parts) == pytest.approx(parts.total, rel=1e-10)
    assert split(np.full(3, 0.1), np.full(3, 0.6)).shares == pytest.approx(
        {"offset": 1, "scale": 0, "shape": 0}
    )


def test_nothing_moved_has_undefined_shares() -> None:
    parts = split(np.arange(4.0), np.arange(4.0))
    assert parts.total == 0
    assert all(np.isnan(share) for share in parts.shares.values())


def test_no_steps_is_refused_with_the_numbers() -> None:
    with pytest.raises(ValueError, match="0 and 0 values"):
        split(np.zeros(0), np.zeros(0))
