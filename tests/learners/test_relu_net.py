"""Networks by hand against torch's own, forward and backward."""

import torch
from torch import Tensor, nn

from irl.learners.relu_net import ReLUNet, linear_layers


def modules() -> tuple[nn.Sequential, nn.Linear, nn.Linear]:
    torch.manual_seed(0)
    body = nn.Sequential(nn.Linear(4, 16), nn.ReLU(), nn.Linear(16, 8), nn.ReLU())
    return body, nn.Linear(8, 2), nn.Linear(8, 3)


def both(dtype: torch.dtype) -> tuple[list[Tensor], list[Tensor]]:
    """Outputs, gradients of inputs, gradients of weights: torch's and ours."""
    x = torch.randn(32, 4, generator=torch.Generator().manual_seed(1))
    weights = torch.randn(32, 5, generator=torch.Generator().manual_seed(2))
    body, *heads = modules()
    a = x.clone().requires_grad_()
    out = torch.cat([head(body(a)) for head in heads], 1)
    (out * weights).sum().backward()
    trained = [p for m in (*linear_layers(body),) for p in (m.weight, m.bias)]
    trained += [heads[0].weight, heads[1].weight, heads[0].bias, heads[1].bias]
    theirs = [out.detach(), a.grad, torch.cat([p.grad.reshape(-1) for p in trained if p.grad is not None])]
    body, *heads = modules()
    net, b = ReLUNet(linear_layers(body), heads, dtype), x.clone().requires_grad_()
    mine = net(b)
    (mine * weights).sum().backward()
    ours = [mine.detach(), b.grad, net.flat.grad]
    return [t for t in theirs if t is not None], [t for t in ours if t is not None]


def test_in_float32_it_is_torch() -> None:
    theirs, ours = both(torch.float32)
    for one, other in zip(theirs, ours, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-5, atol=1e-6)


def test_in_bfloat16_it_is_torch_within_its_rounding() -> None:
    # a gradient may be further off than an output: a unit near zero can switch
    for one, other, off in zip(*both(torch.bfloat16), (0.02, 0.2, 0.1), strict=True):
        assert other.dtype == torch.float32
        assert 0.0 < (one - other).norm() < off * one.norm()


def test_the_modules_see_what_an_optimiser_does_to_the_flat_weights() -> None:
    body, *heads = modules()
    net = ReLUNet(linear_layers(body), heads, torch.bfloat16)
    with torch.no_grad():
        net.flat.mul_(2.0)
    again, *_ = modules()
    torch.testing.assert_close(linear_layers(body)[0].weight, 2.0 * linear_layers(again)[0].weight)
    before = net(torch.ones(1, 4))
    net.refresh()
    assert not torch.equal(before, net(torch.ones(1, 4)))


def test_frozen_weights_get_no_gradient_and_the_input_does() -> None:
    body, *heads = modules()
    net, x = ReLUNet(linear_layers(body), heads), torch.ones(2, 4, requires_grad=True)
    net(x, frozen=True).sum().backward()
    assert net.flat.grad is None
    assert x.grad is not None
    assert x.grad.abs().sum() > 0
