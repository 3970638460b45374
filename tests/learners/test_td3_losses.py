"""Each gradient of TD3's that is written out is autograd's, and targets are smoothed within bounds."""

import torch
from hypothesis import given
from hypothesis import strategies as st

from irl.learners import td3_losses as losses
from irl.learners.sac_gradients import shares

SIZES = st.tuples(st.integers(1, 3), st.integers(1, 5))


@given(sizes=SIZES, seed=st.integers(0, 9), masked=st.booleans())
def test_gradients_are_autograds(sizes: tuple[int, int], seed: int, masked: bool) -> None:
    (n, b), rng = sizes, torch.Generator().manual_seed(seed)
    qs = torch.randn(n, b, generator=rng, dtype=torch.float64, requires_grad=True)
    target = torch.randn(b, generator=rng, dtype=torch.float64)
    (found,) = torch.autograd.grad(losses.critic_loss(qs, target), qs)
    torch.testing.assert_close(losses.of_critics(qs, target), found)
    alive = (torch.rand(b, generator=rng) < 0.5).double() if masked else None
    (found,) = torch.autograd.grad(losses.actor_loss(qs[0], alive), qs)
    torch.testing.assert_close(losses.of_first(qs, shares(target, alive)), found)
    u = torch.randn(b, 2, generator=rng, dtype=torch.float64, requires_grad=True)
    upstream, action = torch.randn(b, 2, generator=rng, dtype=torch.float64), torch.tanh(u)
    (found,) = torch.autograd.grad(action, u, upstream)
    torch.testing.assert_close(losses.of_tanh(action, upstream), found)


def test_noise_is_scaled_then_cut_and_then_the_action_is() -> None:
    action, noise = torch.tensor([[0.0, 0.0, 0.9, -0.9]]), torch.tensor([[1.0, -9.0, 9.0, -9.0]])
    found = losses.smoothed(action, noise, 0.2, 0.5)
    torch.testing.assert_close(found, torch.tensor([[0.2, -0.5, 1.0, -1.0]]))


def test_the_loss_of_two_critics_is_the_sum_of_their_squared_errors() -> None:
    qs, target = torch.tensor([[1.0, 2.0], [0.0, 0.0]]), torch.tensor([0.0, 4.0])
    assert float(losses.critic_loss(qs, target)) == (1.0 + 4.0) / 2 + 16.0 / 2
