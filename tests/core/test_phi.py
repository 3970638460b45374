"""Activations in place: the values they are called after, in each number format."""

import pytest
import torch

from irl.core.phi import PHI


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_tanh_keeps_bfloat16s_three_digits_near_zero(sign: float) -> None:
    z = (sign * torch.linspace(0.01, 0.5, 2000)).bfloat16()
    exact = z.double().tanh()
    phi, _ = PHI["tanh"]
    found = phi(z)
    assert found is z
    # half of its last bit is 0.4 %
    assert float(((found.double() - exact).abs() / exact.abs()).max()) < 0.01


def test_tanh_in_float32_is_by_the_logistic_to_the_bit_and_tanh_to_its_rounding() -> None:
    z = torch.linspace(-30.0, 30.0, 4001)
    phi, _ = PHI["tanh"]
    assert torch.equal(phi(z.clone()), (2.0 * z).sigmoid() * 2.0 - 1.0)
    torch.testing.assert_close(phi(z.clone()), z.tanh(), atol=2e-7, rtol=0.0)


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
@pytest.mark.parametrize("name", PHI)
def test_its_ends_are_finite_and_its_slope_is_autograds(name: str, dtype: torch.dtype) -> None:
    phi, times_slope = PHI[name]
    z = torch.tensor([-1e4, -2.0, -0.1, 0.1, 2.0, 1e4], dtype=dtype)
    h = phi(z.clone())
    assert torch.isfinite(h).all()
    through = z.clone().float().requires_grad_()
    (through.tanh() if name == "tanh" else through.relu()).sum().backward()
    assert through.grad is not None
    torch.testing.assert_close(times_slope(torch.ones_like(h), h).float(), through.grad, atol=0.01, rtol=0.0)
