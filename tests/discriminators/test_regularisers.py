"""Where the slope is asked for, and what it costs there; `Slopes` says how it is found."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from torch import Tensor

from irl.core.nets import Normaliser
from irl.core.rng import torch_stream
from irl.discriminators.regularisers import between, slope_penalty
from irl.discriminators.slopes import Slopes
from irl.rewards.nets import LogitNet, LogitSpec

rows = arrays(np.float64, (5, 3), elements=st.floats(-100, 100)).map(torch.from_numpy)


def points(n: int, inputs: int, shift: float) -> Tensor:
    return shift + torch.randn(n, inputs, generator=torch_stream(0, f"points {shift}"))


def judged(expert: Tensor, policy: Tensor, seed: int = 0) -> Tensor:
    return between(expert, policy, torch_stream(seed, "penalty"))


def network(hidden: tuple[int, ...], inputs: int = 3) -> LogitNet:
    return LogitNet(LogitSpec(inputs - 1, 1, hidden), Normaliser(inputs - 1), torch_stream(0, "net"))


def fine(net: LogitNet, x: Tensor, center: float = 1.0) -> Tensor:
    """The penalty of a network at `x`, as training takes it."""
    return slope_penalty(Slopes(net, x.dtype)(x[:0], x)[1], center)


@given(rows, st.floats(0, 5))
def test_it_is_the_mean_of_each_rows_own_fine(slopes: Tensor, center: float) -> None:
    expected = np.mean([(np.linalg.norm(row) - center) ** 2 for row in slopes.numpy()])
    assert float(slope_penalty(slopes, center)) == pytest.approx(expected, rel=1e-12, abs=1e-14)


@given(rows, st.lists(st.floats(-5, 5), min_size=3, max_size=3))
def test_a_linear_logit_is_fined_for_its_slope_alone(x: Tensor, slope) -> None:
    net = network(()).double()
    with torch.no_grad():
        net.body[0].get_parameter("weight").copy_(torch.tensor([slope], dtype=torch.float64))
    assert float(fine(net, x).detach()) == pytest.approx(
        (np.linalg.norm(slope) - 1) ** 2, rel=1e-12, abs=1e-14
    )


def test_it_looks_at_the_logit_not_at_its_sigmoid() -> None:
    net = network((), 2).double()
    with torch.no_grad():
        net.body[0].get_parameter("weight").copy_(torch.tensor([[0.6, 0.8]]))
    # there sigmoid' is 0, and a penalty on D would be 1
    far = torch.full((4, 2), 100.0, dtype=torch.float64)
    assert float(fine(net, far).detach()) == pytest.approx(0.0)


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
    x = judged(points(50, 3, 3.0), points(50, 3, -2.0))
    # grad of |x|^2 / 2 is x itself
    expected = np.mean([(np.linalg.norm(row) - 1) ** 2 for row in x.double().numpy()])
    assert float(slope_penalty(x)) == pytest.approx(expected, rel=1e-6)


def test_equal_points_are_judged_where_they_are() -> None:
    x = points(20, 3, 1.0)
    torch.testing.assert_close(judged(x, x), x)


def test_the_parameters_get_its_gradient() -> None:
    net = network((), 2)
    with torch.no_grad():
        net.body[0].get_parameter("weight").copy_(torch.tensor([[3.0, 4.0]]))
    slopes = Slopes(net)
    slope_penalty(slopes(points(0, 2, 0.0), points(10, 2, 1.0))[1]).backward()
    (flat,) = slopes.trained
    assert flat.grad is not None
    # d/dw (|w| - 1)^2 = 2 (|w| - 1) w / |w|, and the bias has no part in it
    assert flat.grad.tolist() == pytest.approx([2 * 4 * 0.6, 2 * 4 * 0.8, 0.0], rel=1e-6)


@pytest.mark.parametrize("hidden", [(4,), (4, 3)])
def test_every_weight_of_a_network_is_reached_as_finite_differences_say(hidden: tuple[int, ...]) -> None:
    net = network(hidden, 2).double()
    slopes, x = Slopes(net, torch.float64), judged(points(6, 2, 1.0).double(), points(6, 2, -1.0).double())

    def penalty() -> Tensor:
        return slope_penalty(slopes(x[:0], x)[1])

    (flat,) = slopes.trained
    (gradient,) = torch.autograd.grad(penalty(), flat)
    step, numeric = 1e-6, torch.zeros_like(flat)
    for i in range(len(flat)):
        values = []
        for sign in (1, -1):
            with torch.no_grad():
                flat[i] += sign * step
            values.append(float(penalty().detach()))
            with torch.no_grad():
                flat[i] -= sign * step
        numeric[i] = (values[0] - values[1]) / (2 * step)
    torch.testing.assert_close(gradient, numeric, rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize(("center", "cost"), [(1.0, 1.0), (0.0, 0.0)])
def test_a_flat_logit_costs_the_centres_square_and_its_gradient_is_finite(center: float, cost: float) -> None:
    net = network((4, 4), 2)
    with torch.no_grad():
        for parameter in net.body.parameters():
            parameter.zero_()
    slopes, x = Slopes(net), points(4, 2, 1.0)
    penalty = slope_penalty(slopes(x[:0], x)[1], center)
    penalty.backward()
    assert float(penalty.detach()) == cost
    (flat,) = slopes.trained
    assert flat.grad is not None
    assert torch.isfinite(flat.grad).all()


def test_where_it_looks_is_the_generators() -> None:
    expert, policy = points(5, 2, 3.0), points(5, 2, -2.0)
    first = judged(expert, policy)
    torch.rand(10)
    assert torch.equal(judged(expert, policy), first)
    assert not torch.equal(judged(expert, policy, seed=1), first)


def test_the_global_stream_gets_no_draw_and_the_batches_stay_as_they_are() -> None:
    expert, policy = points(5, 2, 3.0), points(5, 2, -2.0)
    before, kept = torch.get_rng_state(), (expert.clone(), policy.clone())
    x = judged(expert, policy)
    fine(network((4,), 2), x).backward()
    assert torch.equal(torch.get_rng_state(), before)
    assert torch.equal(expert, kept[0])
    assert torch.equal(policy, kept[1])
    assert not any(t.requires_grad for t in (expert, policy, x))


@pytest.mark.parametrize("center", [0.0, 1.0, 2.5])
def test_it_is_what_one_row_at_a_time_gives(center: float) -> None:
    """The slow oracle: one share a row from the same stream, one gradient a row, of the logit."""
    net = network((8,))
    with torch.no_grad():
        net.body[-1].get_parameter("weight").mul_(30.0)  # sure of itself: a sigmoid would be flat there
    expert, policy = points(20, 3, 1.0), points(20, 3, -1.0)
    found = fine(net, judged(expert, policy), center)
    shares = torch.rand(20, 1, generator=torch_stream(0, "penalty"))
    fines = []
    for share, of_expert, of_policy in zip(shares, expert, policy, strict=True):
        x = (share * of_expert + (1 - share) * of_policy).requires_grad_(True)
        (gradient,) = torch.autograd.grad(net.of_inputs(x[None]).sum(), x)
        fines.append((float(gradient.norm()) - center) ** 2)
    assert float(found.detach()) == pytest.approx(np.mean(fines), rel=1e-5)
