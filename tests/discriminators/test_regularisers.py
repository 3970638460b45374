import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from torch import Tensor

from irl.core.nets import mlp
from irl.core.rng import torch_stream
from irl.discriminators.regularisers import gradient_penalty

rows = arrays(np.float64, (5, 3), elements=st.floats(-100, 100)).map(torch.from_numpy)


def points(n: int, inputs: int, shift: float) -> Tensor:
    return shift + torch.randn(n, inputs, generator=torch_stream(0, f"points {shift}"))


def judged(expert: Tensor, policy: Tensor, seed: int = 0) -> Tensor:
    """Where the logit's gradient was taken."""
    seen = []

    def logit(x: Tensor) -> Tensor:
        seen.append(x.detach())
        return x.sum(1)

    gradient_penalty(logit, expert, policy, torch_stream(seed, "penalty"))
    (x,) = seen
    return x


@given(rows, rows, st.lists(st.floats(-5, 5), min_size=3, max_size=3))
def test_a_linear_logit_is_fined_for_its_slope_alone(expert: Tensor, policy: Tensor, slope) -> None:
    weight = torch.tensor(slope, dtype=torch.float64)
    penalty = gradient_penalty(lambda x: x @ weight + 3, expert, policy, torch_stream(0, "penalty"))
    assert float(penalty) == pytest.approx((np.linalg.norm(slope) - 1) ** 2, rel=1e-12, abs=1e-14)


def test_it_looks_at_the_logit_not_at_its_sigmoid() -> None:
    x = torch.full((4, 2), 100.0, dtype=torch.float64)
    unit = torch.tensor([0.6, 0.8], dtype=torch.float64)
    # there sigmoid' is 0, and a penalty on D would be 1
    assert float(gradient_penalty(lambda z: z @ unit, x, x, torch_stream(0, "p"))) == pytest.approx(0.0)


def test_it_looks_between_the_two_one_share_a_row() -> None:
    expert, policy = points(200, 6, 3.0), points(200, 6, -2.0)
    share = (judged(expert, policy) - policy) / (expert - policy)
    spread = share.max(1).values - share.min(1).values
    # one number a row, up to float32: drawn for each element it would spread over most of [0, 1]
    assert float(spread.max()) < 1e-3
    share = share.mean(1)
    assert float(share.min()) >= 0.0
    assert float(share.max()) <= 1.0
    # uniform on [0, 1]: mean 1/2, deviation 0.289; 200 draws know them to 0.02 and 0.01
    assert float(share.mean()) == pytest.approx(0.5, abs=0.08)
    assert float(share.std()) == pytest.approx(0.289, abs=0.04)


def test_a_curved_logit_is_fined_for_the_slope_at_those_points() -> None:
    expert, policy = points(50, 3, 3.0), points(50, 3, -2.0)
    # grad of |x|^2 / 2 is x itself
    penalty = gradient_penalty(lambda x: x.square().sum(1) / 2, expert, policy, torch_stream(0, "penalty"))
    expected = (judged(expert, policy).norm(dim=1) - 1).square().mean()
    assert float(penalty.detach()) == pytest.approx(float(expected), rel=1e-6)


def test_equal_points_are_judged_where_they_are() -> None:
    x = points(20, 3, 1.0)
    torch.testing.assert_close(judged(x, x), x)


def test_the_parameters_get_its_gradient() -> None:
    weight = torch.tensor([3.0, 4.0], requires_grad=True)
    x = points(10, 2, 1.0)
    gradient_penalty(lambda z: z @ weight, x, -x, torch_stream(0, "penalty")).backward()
    assert weight.grad is not None
    # d/dw (|w| - 1)^2 = 2 (|w| - 1) w / |w|
    assert weight.grad.tolist() == pytest.approx([2 * 4 * 0.6, 2 * 4 * 0.8], rel=1e-6)


def test_every_weight_of_a_network_is_reached_as_finite_differences_say() -> None:
    net = mlp((2, 4, 1), "tanh", torch_stream(0, "net")).double()
    expert, policy = points(6, 2, 1.0).double(), points(6, 2, -1.0).double()

    def penalty() -> Tensor:
        return gradient_penalty(lambda x: net(x).squeeze(1), expert, policy, torch_stream(0, "p"))

    weight = next(net.parameters())
    (gradient,) = torch.autograd.grad(penalty(), weight)
    step, numeric = 1e-6, torch.zeros_like(weight)
    for index in np.ndindex(*weight.shape):
        values = []
        for sign in (1, -1):
            with torch.no_grad():
                weight[index] += sign * step
            values.append(float(penalty().detach()))
            with torch.no_grad():
                weight[index] -= sign * step
        numeric[index] = (values[0] - values[1]) / (2 * step)
    torch.testing.assert_close(gradient, numeric.detach(), rtol=1e-5, atol=1e-8)


def test_a_flat_logit_is_fined_one_and_its_gradient_is_finite() -> None:
    weight = torch.zeros(2, requires_grad=True)
    x = points(4, 2, 1.0)
    penalty = gradient_penalty(lambda z: z @ weight, x, -x, torch_stream(0, "penalty"))
    penalty.backward()
    assert float(penalty.detach()) == 1.0
    assert weight.grad is not None
    assert torch.isfinite(weight.grad).all()


def test_it_is_the_generators() -> None:
    expert, policy = points(5, 2, 3.0), points(5, 2, -2.0)
    first = judged(expert, policy)
    torch.rand(10)
    assert torch.equal(judged(expert, policy), first)
    assert not torch.equal(judged(expert, policy, seed=1), first)


def test_the_batches_get_no_gradient_and_the_global_stream_no_draw() -> None:
    expert, policy = points(5, 2, 3.0), points(5, 2, -2.0)
    before = torch.get_rng_state()
    gradient_penalty(lambda x: x.square().sum(1), expert, policy, torch_stream(0, "penalty"))
    assert torch.equal(torch.get_rng_state(), before)
    assert not expert.requires_grad


@pytest.mark.parametrize("center", [0.0, 1.0, 2.5])
def test_it_is_what_one_row_at_a_time_gives(center: float) -> None:
    """The slow oracle: one share a row from the same stream, one gradient a row, of the logit."""
    net = mlp((3, 8, 1), "tanh", torch_stream(0, "net"))
    expert, policy = points(20, 3, 1.0), points(20, 3, -1.0)

    def logit(x: Tensor) -> Tensor:
        return 30 * net(x).squeeze(1)  # sure of itself: a sigmoid would be flat there

    found = gradient_penalty(logit, expert, policy, torch_stream(0, "penalty"), center)
    shares = torch.rand(20, 1, generator=torch_stream(0, "penalty"))
    fines = []
    for share, of_expert, of_policy in zip(shares, expert, policy, strict=True):
        x = (share * of_expert + (1 - share) * of_policy).requires_grad_(True)
        (gradient,) = torch.autograd.grad(logit(x[None]).sum(), x)
        fines.append((float(gradient.norm()) - center) ** 2)
    assert float(found.detach()) == pytest.approx(np.mean(fines), rel=1e-5)


def test_centred_at_zero_a_flat_logit_is_free_and_its_gradient_finite() -> None:
    weight = torch.zeros(2, requires_grad=True)
    x = points(4, 2, 1.0)
    penalty = gradient_penalty(lambda z: z @ weight, x, -x, torch_stream(0, "penalty"), 0.0)
    penalty.backward()
    assert float(penalty.detach()) == 0.0
    assert weight.grad is not None
    assert torch.isfinite(weight.grad).all()
