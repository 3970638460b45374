"""Logits and slopes in one pass are those of autograd, by hand and with spectral norms."""

import copy
from collections.abc import Sequence

import pytest
import torch
from torch import Tensor

from irl.core.nets import Normaliser, SpectralLinear
from irl.core.rng import torch_stream
from irl.discriminators.slopes import Slopes, input_gradient
from irl.rewards.nets import LogitNet, LogitSpec


def network(
    activation: str = "tanh", hidden: tuple[int, ...] = (8, 6), spectral_norm: bool = False
) -> LogitNet:
    spec = LogitSpec(3, 2, hidden, activation, spectral_norm=spectral_norm)
    return LogitNet(spec, Normaliser(3), torch_stream(0, "net"))


def points(n: int, name: str = "x", dtype: torch.dtype = torch.float64) -> Tensor:
    return 2.0 * torch.randn(n, 5, generator=torch_stream(0, name), dtype=dtype)


def by_autograd(net: LogitNet, x: Tensor) -> Tensor:
    """The slow oracle: the logit's gradient, one row at a time."""
    rows = [row[None].clone().requires_grad_() for row in x]
    return torch.cat(
        [torch.autograd.grad(net.of_inputs(row).sum(), row, create_graph=True)[0] for row in rows]
    )


def loss(logits: Tensor, slopes: Tensor) -> Tensor:
    """Anything curved in both."""
    return torch.nn.functional.softplus(logits).mean() + (slopes.norm(dim=1) - 1.0).square().mean()


def flat(tensors: Sequence[Tensor | None]) -> Tensor:
    return torch.cat([t.reshape(-1) for t in tensors if t is not None])


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("hidden", [(), (8,), (8, 6)])
def test_by_hand_they_and_their_gradient_are_autograds(activation: str, hidden: tuple[int, ...]) -> None:
    net, other = network(activation, hidden).double(), network(activation, hidden).double()
    slopes, x, sloped = Slopes(net, torch.float64), points(7), points(4, "sloped")
    found = slopes(x, sloped)
    expected = other.of_inputs(x), by_autograd(other, sloped)
    for one, its in zip(found, expected, strict=True):
        torch.testing.assert_close(one, its)
    loss(*found).backward()
    loss(*expected).backward()
    (trained,) = slopes.trained
    assert trained.grad is not None
    torch.testing.assert_close(trained.grad, flat([p.grad for p in other.body.parameters()]))


def test_with_spectral_norms_they_are_those_of_the_divided_weights() -> None:
    net = network(spectral_norm=True).double()
    slopes, x, sloped = Slopes(net), points(7), points(4, "sloped")
    assert slopes.trained == list(net.parameters())
    vectors = {name: value.clone() for name, value in net.state_dict().items()}
    with torch.no_grad():
        for layer in net.body:
            if isinstance(layer, SpectralLinear):
                layer.weight.mul_(3.0).add_(0.1)
    followed = copy.deepcopy(net)
    followed.iterate()
    found, expected = slopes(x, sloped), (followed.of_inputs(x), by_autograd(followed, sloped))
    for one, its in zip(found, expected, strict=True):
        torch.testing.assert_close(one, its)
    loss(*found).backward()
    loss(*expected).backward()
    grads = [flat([p.grad for p in one.parameters()]) for one in (net, followed)]
    torch.testing.assert_close(*grads)
    # the vectors went one step on, once
    for name, value in net.state_dict().items():
        assert torch.equal(value, followed.state_dict()[name])
        assert name.rpartition(".")[2] not in "uv" or len(value) == 1 or not torch.equal(value, vectors[name])
    slopes.refresh()


@pytest.mark.parametrize("spectral_norm", [False, True])
def test_without_sloped_rows_there_are_only_logits(spectral_norm: bool) -> None:
    net = network(spectral_norm=spectral_norm).double()
    x = points(7)
    logits, slopes = Slopes(net, torch.float64)(x, x[:0])
    assert slopes.shape == (0, 5)
    torch.testing.assert_close(logits, net.of_inputs(x))
    logits.sum().backward()


def test_an_optimisers_step_on_what_is_trained_moves_the_network_that_judges() -> None:
    net = network().float()
    slopes, x = Slopes(net), points(7, dtype=torch.float32)
    before = net.of_inputs(x).detach()
    adam = torch.optim.Adam(slopes.trained, lr=0.1)
    slopes(x, x)[0].sum().backward()
    adam.step()
    assert float((net.of_inputs(x) - before).mean().detach()) < -0.1
    torch.testing.assert_close(slopes(x, x)[0], net.of_inputs(x))


def test_the_input_gradient_of_a_linear_logit_is_its_weight() -> None:
    net, x = network(hidden=()).double(), points(4)
    weight = net.body[0].get_parameter("weight")
    assert torch.equal(input_gradient(net, x), weight.expand(4, -1))
    assert not x.requires_grad
