"""Each gradient is what autograd finds of the loss it belongs to, in float64."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from irl.learners import sac_gradients as gradients
from irl.learners.sac_losses import actor_loss, critic_loss, mean_alive, squashed, temperature_loss

B, A = 6, 2
ALIVE = [
    None,
    torch.tensor([1.0, 0, 1, 1, 0, 1], dtype=torch.float64),
    torch.ones(B, dtype=torch.float64),
    torch.zeros(B, dtype=torch.float64),
]


def drawn(*shape: int, seed: int = 0) -> Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def of(loss: Tensor, *inputs: Tensor) -> tuple[Tensor, ...]:
    return torch.autograd.grad(loss, inputs)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_of_critics_is_that_of_the_critic_loss(n: int) -> None:
    qs, target = drawn(n, B).requires_grad_(), drawn(B, seed=1)
    (expected,) = of(critic_loss(qs, target), qs)
    torch.testing.assert_close(gradients.of_critics(qs.detach(), target), expected)


@pytest.mark.parametrize("alive", ALIVE)
def test_shares_are_the_gradient_of_a_mean_over_the_living(alive: Tensor | None) -> None:
    values = drawn(B).requires_grad_()
    (expected,) = of(mean_alive(values, alive), values)
    shares = gradients.shares(values.detach(), alive)
    torch.testing.assert_close(shares, expected)
    # all of them, or none where nobody is alive
    living = B if alive is None else int(alive.sum())
    assert float(shares.sum()) == pytest.approx(1.0 if living else 0.0)


@pytest.mark.parametrize("alive", ALIVE)
@pytest.mark.parametrize("n", [1, 2, 3])
def test_of_values_is_that_of_the_actor_loss_at_the_lowest_critic(n: int, alive: Tensor | None) -> None:
    qs, log_pi = drawn(n, B).requires_grad_(), drawn(B, seed=1)
    (expected,) = of(actor_loss(qs.amin(0), log_pi, torch.tensor(0.3).double(), alive), qs)
    found = gradients.of_values(qs.detach(), gradients.shares(log_pi, alive))
    torch.testing.assert_close(found, expected)


def test_where_critics_agree_one_of_them_has_the_whole_share() -> None:
    qs = torch.tensor([[1.0, 2.0, 0.0], [1.0, 2.0, 5.0]], dtype=torch.float64).requires_grad_()
    (expected,) = of(-(qs.min(0).values).mean(), qs)
    found = gradients.of_values(qs.detach(), gradients.shares(qs.detach()[0], None))
    # the same one that a minimum of torch names, and so SB3
    torch.testing.assert_close(found, expected)
    assert found.sum(0).tolist() == pytest.approx([-1 / 3] * 3)
    assert ((found != 0).sum(0) == 1).all()


@given(scale=st.floats(0.01, 3.0), shift=st.floats(-3.0, 1.0), seed=st.integers(0, 50))
def test_of_squashed_is_that_of_any_loss_of_action_and_density(scale: float, shift: float, seed: int) -> None:
    mean, log_std = (
        (scale * drawn(B, A, seed=seed)).requires_grad_(),
        (shift + 0.3 * drawn(B, A)).requires_grad_(),
    )
    noise, weights, of_log_pi = (
        drawn(B, A, seed=seed + 1),
        drawn(B, A, seed=seed + 2),
        drawn(B, seed=seed + 3),
    )
    action, log_pi = squashed(mean, log_std, noise)
    expected = of((weights * action).sum() + (of_log_pi * log_pi).sum(), mean, log_std)
    moved = log_std.detach().exp() * noise
    found = gradients.of_squashed(action.detach(), moved, weights, of_log_pi)
    for one, its in zip(found, expected, strict=True):
        torch.testing.assert_close(one, its, rtol=1e-6, atol=1e-9)


def test_far_in_the_tails_the_gradient_stays_finite() -> None:
    """There 1 - a^2 is 0: the action no longer moves, and only the density's own part is left."""
    mean, log_std, noise = torch.full((1, 1), 40.0), torch.zeros(1, 1), torch.zeros(1, 1)
    action, _ = squashed(mean, log_std, noise)
    of_mean, of_log_std = gradients.of_squashed(action, noise, torch.ones(1, 1), torch.tensor([0.5]))
    assert of_mean.item() == 0.0
    assert of_log_std.item() == -0.5


@pytest.mark.parametrize("alive", ALIVE)
def test_the_whole_of_an_actors_step_is_that_of_the_actor_loss(alive: Tensor | None) -> None:
    """Critics that are curved in the action: the parts put together as the update does."""
    mean, log_std = drawn(B, A).requires_grad_(), (0.3 * drawn(B, A, seed=1) - 0.5).requires_grad_()
    noise, temperature = drawn(B, A, seed=2), torch.tensor(0.3, dtype=torch.float64)
    optima = drawn(2, 1, A, seed=3)

    def critics(action: Tensor) -> Tensor:
        return -(action - optima).square().sum(2)

    action, log_pi = squashed(mean, log_std, noise)
    expected = of(actor_loss(critics(action).amin(0), log_pi, temperature, alive), mean, log_std)
    shares = gradients.shares(log_pi.detach(), alive)
    free = action.detach().requires_grad_()
    qs = critics(free)
    (of_action,) = torch.autograd.grad(qs, free, gradients.of_values(qs.detach(), shares))
    moved = log_std.detach().exp() * noise
    found = gradients.of_squashed(action.detach(), moved, of_action, temperature * shares)
    for one, its in zip(found, expected, strict=True):
        torch.testing.assert_close(one, its)


@pytest.mark.parametrize("alive", ALIVE)
def test_minus_the_shared_excess_is_that_of_the_temperature_loss(alive: Tensor | None) -> None:
    log_temperature, log_pi = drawn(1).requires_grad_(), drawn(B, seed=1)
    (expected,) = of(temperature_loss(log_temperature, log_pi, -2.0, alive), log_temperature)
    found = -(gradients.shares(log_pi, alive) * (log_pi - 2.0)).sum(0, keepdim=True)
    torch.testing.assert_close(found, expected)
