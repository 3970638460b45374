"""Values, slopes and gradients by hand against autograd's in float64."""

import pytest
import torch
import torch.nn.functional as F
from torch import Tensor, nn

from irl.core.flat import linear_layers
from irl.core.nets import mlp
from irl.core.perceptron import Perceptron
from irl.core.rng import torch_stream

DEPTHS = [(), (7,), (7, 5), (7, 5, 6)]


def network(activation: str, hidden: tuple[int, ...], dtype: torch.dtype = torch.float64) -> nn.Sequential:
    return mlp((4, *hidden, 1), activation, torch_stream(0, "net")).to(dtype)


def by_hand(net: nn.Sequential, activation: str, dtype: torch.dtype = torch.float64) -> Perceptron:
    return Perceptron(linear_layers(net), activation, dtype)


def points(n: int = 9, dtype: torch.dtype = torch.float64) -> Tensor:
    return 2.0 * torch.randn(n, 4, generator=torch_stream(0, "x"), dtype=dtype)


def by_autograd(net: nn.Sequential, x: Tensor, n: int) -> tuple[Tensor, Tensor]:
    """The values of all rows, and the input gradients of the last `n`."""
    ends = x[len(x) - n :].clone().requires_grad_()
    (slopes,) = torch.autograd.grad(net(ends).sum(), ends, create_graph=True)
    return net(x).squeeze(1), slopes


def loss(values: Tensor, slopes: Tensor) -> Tensor:
    """Curved in both, and no row counts as another does."""
    weights = torch.linspace(-1.0, 2.0, len(values), dtype=values.dtype)
    return (weights * F.softplus(values)).sum() + (slopes.norm(dim=1) - 1.0).square().sum()


def gradient(net: nn.Sequential) -> Tensor:
    # a bias that no row reaches has none
    parts = [torch.zeros_like(p) if p.grad is None else p.grad for p in net.parameters()]
    return torch.cat([part.reshape(-1) for part in parts])


@pytest.mark.parametrize("slopes", [0, 3, 9])
@pytest.mark.parametrize("hidden", DEPTHS)
@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_it_is_autograd(activation: str, hidden: tuple[int, ...], slopes: int) -> None:
    net, other, x = network(activation, hidden), network(activation, hidden), points()
    fast = by_hand(net, activation)
    found, expected = fast(x, slopes), by_autograd(other, x, slopes)
    for one, its in zip(found, expected, strict=True):
        torch.testing.assert_close(one, its)
    alone = fast.values(x)
    torch.testing.assert_close(alone, expected[0].detach())
    assert not alone.requires_grad
    loss(*found).backward()
    loss(*expected).backward()
    assert fast.flat.grad is not None
    torch.testing.assert_close(fast.flat.grad, gradient(other))


@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_a_loss_of_the_slopes_alone_is_differentiated_too(activation: str) -> None:
    net, other, x = network(activation, (7, 5)), network(activation, (7, 5)), points()
    fast = by_hand(net, activation)
    fast(x, 4)[1].square().sum().backward()
    by_autograd(other, x, 4)[1].square().sum().backward()
    assert fast.flat.grad is not None
    torch.testing.assert_close(fast.flat.grad, gradient(other))


def test_gradients_of_several_evaluations_add_up() -> None:
    """In one loss, and from one loss to the next."""
    net, other, x = network("tanh", (7, 5)), network("tanh", (7, 5)), points()
    fast = by_hand(net, "tanh")
    (loss(*fast(x, 4)) + loss(*fast(3.0 * x, 2))).backward()
    loss(*fast(-x, 5)).backward()
    (loss(*by_autograd(other, x, 4)) + loss(*by_autograd(other, 3.0 * x, 2))).backward()
    loss(*by_autograd(other, -x, 5)).backward()
    assert fast.flat.grad is not None
    torch.testing.assert_close(fast.flat.grad, gradient(other))


def test_slopes_stay_what_they_were_when_the_weights_move() -> None:
    for hidden in DEPTHS:
        fast = by_hand(network("tanh", hidden), "tanh")
        _, slopes = fast(points(), 1)
        kept = slopes.detach().clone()
        with torch.no_grad():
            fast.flat.mul_(2.0)
        assert torch.equal(slopes, kept)


def test_an_optimisers_step_is_the_modules_and_a_modules_change_is_seen() -> None:
    net, x = network("tanh", (7, 5)), points()
    fast = by_hand(net, "tanh")
    adam, before = torch.optim.Adam([fast.flat], lr=0.01), net(x).sum()
    fast(x)[0].sum().backward()
    adam.step()
    assert float((net(x).sum() - before).detach()) < -0.1
    torch.testing.assert_close(fast(x)[0], net(x).squeeze(1))
    net.load_state_dict(network("tanh", (7, 5)).state_dict())
    torch.testing.assert_close(fast(x)[0].sum(), before)
    assert torch.equal(nn.utils.parameters_to_vector(net.parameters()), fast.flat)


def off(one: Tensor, other: Tensor) -> float:
    return float(((one - other).norm() / other.norm()).detach())


@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_bfloat16_is_within_its_rounding_and_everything_that_leaves_is_float32(activation: str) -> None:
    shape = (activation, (32, 32), torch.float32)
    net, other, x = network(*shape), network(*shape), points(64, torch.float32)
    fast = by_hand(net, activation, torch.bfloat16)
    found, expected = fast(x, 32), by_autograd(other, x, 32)
    for one, its in zip(found, expected, strict=True):
        assert one.dtype == torch.float32
        # 8 bits are 0.4 %, a few roundings of them; a slope of relu also switches
        assert 0.0 < off(one, its) < (0.02 if activation == "tanh" else 0.1)
    torch.testing.assert_close(fast.values(x), expected[0].detach())
    loss(*found).backward()
    loss(*expected).backward()
    assert fast.flat.grad is not None
    assert fast.flat.grad.dtype == torch.float32
    assert 0.0 < off(fast.flat.grad, gradient(other)) < 0.1


@pytest.mark.parametrize("hidden", [(), (7,)])
def test_with_no_two_hidden_layers_bfloat16_rounds_no_weight(hidden: tuple[int, ...]) -> None:
    net, x = network("tanh", hidden, torch.float32), points(dtype=torch.float32)
    fast = by_hand(net, "tanh", torch.bfloat16)
    values, slopes = fast(x, 9)
    expected = by_autograd(net, x, 9)
    # but what a hidden layer hands on
    torch.testing.assert_close(values, expected[0], rtol=0.0, atol=1e-5 if not hidden else 5e-3)
    assert slopes.dtype == torch.float32
    assert off(slopes, expected[1]) < (1e-6 if not hidden else 0.01)


def test_rounded_weights_follow_when_told_to() -> None:
    net, x = network("tanh", (7, 5, 6), torch.float32), points(dtype=torch.float32)
    fast = by_hand(net, "tanh", torch.bfloat16)
    with torch.no_grad():
        linear_layers(net)[1].weight.mul_(-1.0)
    stale = off(fast(x)[0], net(x).squeeze(1))
    fast.refresh()
    assert off(fast(x)[0], net(x).squeeze(1)) < 0.02 < stale


def test_an_activation_that_is_not_known_is_refused() -> None:
    with pytest.raises(KeyError, match="gelu"):
        by_hand(network("tanh", (7,)), "gelu")
