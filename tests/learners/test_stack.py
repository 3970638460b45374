"""Networks side by side against torch's own, forward and backward."""

import pytest
import torch
from torch import Tensor, nn

from irl.core.flat import linear_layers
from irl.learners.stack import Stack

HEADS = [(5,), (2, 3)]


def modules(
    n: int, outputs: tuple[int, ...], hidden: tuple[int, ...] = (16, 8)
) -> list[tuple[nn.Sequential, list[nn.Linear]]]:
    """`n` networks, each a body and its heads."""
    torch.manual_seed(0)
    made = []
    for _ in range(n):
        sizes = (4, *hidden)
        layers = [m for i, j in zip(sizes, hidden, strict=False) for m in (nn.Linear(i, j), nn.ReLU())]
        made.append((nn.Sequential(*layers), [nn.Linear(sizes[-1], k) for k in outputs]))
    return made


def stacked(nets: list[tuple[nn.Sequential, list[nn.Linear]]], dtype: torch.dtype = torch.float32) -> Stack:
    return Stack([linear_layers(body) for body, _ in nets], [heads for _, heads in nets], dtype=dtype)


def drawn(*shape: int, seed: int = 1) -> Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed))


def outputs_of(nets: list[tuple[nn.Sequential, list[nn.Linear]]], x: Tensor) -> Tensor:
    return torch.stack([torch.cat([head(body(x)) for head in heads], 1) for body, heads in nets])


def by_torch(
    n: int, outputs: tuple[int, ...], of_y: Tensor, hidden: tuple[int, ...] = (16, 8)
) -> list[Tensor]:
    """Outputs, gradients in the weights of each network and in the inputs through each."""
    nets = modules(n, outputs, hidden)
    xs = [drawn(32, 4).requires_grad_() for _ in nets]
    ys = torch.stack([outputs_of([net], x)[0] for net, x in zip(nets, xs, strict=True)])
    (ys * of_y).sum().backward()
    # layer by layer, all weights before all biases; the heads of a network are one layer
    layers = [list(layer) for layer in zip(*[linear_layers(body) for body, _ in nets], strict=True)]
    layers += [[head for _, heads in nets for head in heads]]
    gradients = [getattr(m, part).grad for layer in layers for part in ("weight", "bias") for m in layer]
    return [
        ys.detach(),
        torch.cat([g.reshape(-1) for g in gradients]),
        torch.stack([x.grad for x in xs if x.grad is not None]),
    ]


def by_hand(
    n: int, outputs: tuple[int, ...], of_y: Tensor, dtype: torch.dtype, hidden: tuple[int, ...] = (16, 8)
) -> list[Tensor]:
    net = stacked(modules(n, outputs, hidden), dtype)
    y, seen = net(drawn(32, 4))
    net.differentiate(of_y, seen)
    assert net.flat.grad is not None
    return [y, net.flat.grad, net.into_inputs(of_y, seen)]


@pytest.mark.parametrize("hidden", [(), (16,), (16, 8)])
@pytest.mark.parametrize("outputs", HEADS)
@pytest.mark.parametrize("n", [1, 2])
def test_in_float32_it_is_torch(n: int, outputs: tuple[int, ...], hidden: tuple[int, ...]) -> None:
    of_y = drawn(n, 32, 5, seed=2)
    found = by_hand(n, outputs, of_y, torch.float32, hidden)
    for one, its in zip(found, by_torch(n, outputs, of_y, hidden), strict=True):
        torch.testing.assert_close(one, its, rtol=1e-5, atol=2e-6)


@pytest.mark.parametrize("outputs", HEADS)
@pytest.mark.parametrize("n", [1, 2])
def test_in_bfloat16_it_is_torch_within_its_rounding(n: int, outputs: tuple[int, ...]) -> None:
    of_y = drawn(n, 32, 5, seed=2)
    found, expected = by_hand(n, outputs, of_y, torch.bfloat16), by_torch(n, outputs, of_y)
    # a gradient may be further off than an output: a unit near zero can switch
    for one, its, off in zip(found, expected, (0.02, 0.2, 0.2), strict=True):
        assert one.dtype == torch.float32
        assert 0.0 < (one - its).norm() < off * its.norm()


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
@pytest.mark.parametrize("outputs", HEADS)
def test_values_alone_are_torchs_unrounded_and_follow_the_weights(
    outputs: tuple[int, ...], dtype: torch.dtype
) -> None:
    nets, x = modules(2, outputs), drawn(32, 4)
    net = stacked(nets, dtype)
    for _ in range(2):
        torch.testing.assert_close(net.values(x), outputs_of(nets, x))
        net.flat.mul_(0.5)


def test_a_gradient_replaces_the_one_before_it() -> None:
    of_y, net = drawn(2, 32, 5, seed=2), stacked(modules(2, (5,)))
    _, seen = net(drawn(32, 4))
    net.differentiate(of_y, seen)
    assert net.flat.grad is not None
    once = net.flat.grad.clone()
    net.differentiate(of_y, seen)
    assert torch.equal(net.flat.grad, once)
    net.into_inputs(of_y, seen)
    assert torch.equal(net.flat.grad, once)


def test_rows_can_be_left_out_of_the_gradient() -> None:
    """What the actor does: one evaluation of both ends of a step, learnt from at the first."""
    of_y, net, x = drawn(1, 20, 5, seed=2), stacked(modules(1, (2, 3))), drawn(32, 4)
    _, seen = net(x)
    net.differentiate(of_y, [h[:, :20] for h in seen])
    assert net.flat.grad is not None
    found = net.flat.grad.clone()
    _, seen = net(x[:20])
    net.differentiate(of_y, seen)
    torch.testing.assert_close(found, net.flat.grad)


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_the_modules_see_what_an_optimiser_does_to_the_flat_weights(dtype: torch.dtype) -> None:
    nets, x = modules(2, (2, 3)), drawn(32, 4)
    net = stacked(nets, dtype)
    adam = torch.optim.Adam([net.flat], lr=0.01)
    before = outputs_of(nets, x).detach()
    _, seen = net(x)
    net.differentiate(torch.ones(2, 32, 5), seen)
    adam.step()
    net.refresh()
    after = outputs_of(nets, x).detach()
    assert ((after - before).mean((1, 2)) < -0.02).all()
    torch.testing.assert_close(net(x)[0], after, rtol=0.0, atol=1e-5 if dtype == torch.float32 else 0.05)


def test_rounded_weights_follow_when_told_to() -> None:
    nets, x = modules(2, (5,)), drawn(32, 4)
    net = stacked(nets, torch.bfloat16)
    with torch.no_grad():
        for body, _ in nets:
            linear_layers(body)[1].weight.mul_(-1.0)
    stale = net(x)[0]
    net.refresh()
    fresh, expected = net(x)[0], outputs_of(nets, x)
    assert (fresh - expected).norm() < 0.02 * expected.norm() < (stale - expected).norm()


def test_a_value_of_thousands_keeps_its_digits_in_bfloat16() -> None:
    """The last bias is float32: 4321.25 has no bfloat16."""
    nets = modules(2, (1,))
    net = stacked(nets, torch.bfloat16)
    with torch.no_grad():
        for _, (head,) in nets:
            head.weight.zero_()
            head.bias.fill_(4321.25)
    net.refresh()
    assert net(drawn(3, 4))[0].unique().tolist() == [4321.25]
