"""Each value against torch's own, each derivative against autograd."""

import math

import pytest
import torch
from torch import Tensor
from torch.distributions import Normal

from irl.learners import ppo_losses as losses


def draws(*shape: int, seed: int = 0) -> Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def test_density_and_entropy_are_those_of_torchs_normal() -> None:
    mean, log_std, action = draws(7, 3), 0.3 * draws(3, seed=1), draws(7, 3, seed=2)
    normal = Normal(mean, log_std.exp())
    found = losses.log_density((action - mean) / log_std.exp(), log_std)
    torch.testing.assert_close(found, normal.log_prob(action).sum(1))
    torch.testing.assert_close(losses.entropy(log_std), normal.entropy()[0].sum())


def test_density_integrates_to_one() -> None:
    grid = torch.linspace(-12, 12, 4001, dtype=torch.float64)
    log_std = torch.tensor([0.4], dtype=torch.float64)
    z = (grid[:, None] - 0.7) / log_std.exp()
    assert float(losses.log_density(z, log_std).exp().sum() * (grid[1] - grid[0])) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("advantage", "ratio", "value", "slope"),
    [
        (2.0, 1.1, 2.2, 2.2),  # within the bounds: free
        (2.0, 1.5, 2.4, 0.0),  # good, and already likelier by more than a fifth: no further
        (2.0, 0.5, 1.0, 1.0),  # good, and rarer: back
        (-2.0, 0.5, -1.6, 0.0),  # bad, and already rarer
        (-2.0, 1.5, -3.0, -3.0),  # bad, and likelier: back
    ],
)
def test_the_surrogate_lets_a_policy_back_and_no_further(
    advantage: float, ratio: float, value: float, slope: float
) -> None:
    found, derivative = losses.surrogate(torch.tensor([advantage]), torch.tensor([ratio]), 0.2)
    assert float(found) == pytest.approx(value)
    assert float(derivative) == pytest.approx(slope)


def test_its_derivative_is_autograds() -> None:
    advantage, log_ratio = draws(50), (0.3 * draws(50, seed=1)).requires_grad_(True)
    value, derivative = losses.surrogate(advantage, log_ratio.exp(), 0.2)
    (expected,) = torch.autograd.grad(value.sum(), log_ratio)
    torch.testing.assert_close(derivative, expected)


@pytest.mark.parametrize("clip", [None, 0.2])
def test_the_values_error_and_its_derivative(clip: float | None) -> None:
    value, old, returns = draws(50).requires_grad_(True), draws(50, seed=1), draws(50, seed=2)
    error, derivative = losses.value_error(value, old, returns, clip)
    held = value if clip is None else old + (value - old).clamp(-clip, clip)
    (expected,) = torch.autograd.grad((held - returns).square().sum(), value)
    torch.testing.assert_close(error, (held - returns).square())
    torch.testing.assert_close(derivative, expected)
    assert bool((derivative == 0).any()) == (clip is not None)


def test_the_approximate_kl_is_that_of_two_gaussians() -> None:
    """KL(N(0, 1) || N(m, 1)) = m^2 / 2; over draws of the first."""
    action, m = draws(200_000), 0.5
    log_ratio = -0.5 * (action - m).square() + 0.5 * action.square()
    assert float(losses.approximate_kl(log_ratio)) == pytest.approx(m**2 / 2, rel=0.02)
    assert float(losses.approximate_kl(torch.zeros(5))) == 0.0
    assert math.isfinite(float(losses.approximate_kl(torch.full((5,), -50.0))))
