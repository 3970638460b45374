"""Weights in one tensor: the same numbers under two names, whoever changes them."""

import copy
import pickle

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import nn

from irl.core.flat import Tied, flattened, linear_layers, views


def parameters(*shapes: tuple[int, ...]) -> list[nn.Parameter]:
    return [nn.Parameter(torch.randn(shape)) for shape in shapes]


@given(st.lists(st.lists(st.integers(1, 4), min_size=1, max_size=3).map(tuple), min_size=1, max_size=4))
def test_the_numbers_stand_in_a_row_and_keep_their_shapes(shapes: list[tuple[int, ...]]) -> None:
    given = parameters(*shapes)
    before = [p.detach().clone() for p in given]
    flat = flattened(given)
    assert torch.equal(flat, torch.cat([value.reshape(-1) for value in before]))
    assert not flat.requires_grad
    for parameter, value, view in zip(given, before, views(flat, [p.shape for p in given]), strict=True):
        assert torch.equal(parameter, value)
        assert torch.equal(view, value)


def test_who_changes_one_changes_both() -> None:
    weight, bias = given = parameters((2, 3), (2,))
    flat = flattened(given)
    flat.fill_(7.0)
    assert torch.equal(weight.detach(), torch.full((2, 3), 7.0))
    with torch.no_grad():
        bias.copy_(torch.tensor([1.0, 2.0]))
    assert flat.tolist() == [7.0] * 6 + [1.0, 2.0]
    views(flat, [weight.shape, bias.shape])[0][0, 0] = -1.0
    assert weight[0, 0] == -1.0


def test_loading_weights_into_a_module_loads_them_into_the_row() -> None:
    net, other = nn.Linear(3, 2), nn.Linear(3, 2)
    flat = flattened(list(net.parameters()))
    net.load_state_dict(other.state_dict())
    assert torch.equal(flat, nn.utils.parameters_to_vector(other.parameters()))


def test_a_module_still_learns_by_its_own_parameters() -> None:
    net = nn.Linear(3, 1)
    flat = flattened(list(net.parameters()))
    before = flat.clone()
    sgd = torch.optim.SGD(net.parameters(), lr=0.5)
    net(torch.tensor([[1.0, 2.0, 3.0]])).sum().backward()
    sgd.step()
    torch.testing.assert_close(flat, before - 0.5 * torch.tensor([1.0, 2.0, 3.0, 1.0]))


def test_linear_layers_come_in_order_and_alone() -> None:
    inner = nn.Sequential(nn.Linear(2, 3), nn.Tanh())
    net = nn.Sequential(nn.LayerNorm(2), inner, nn.Linear(3, 1))
    assert linear_layers(net) == [inner[0], net[2]]


def test_a_copy_of_what_is_tied_is_refused() -> None:
    for make in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="a Tied is tied to its modules' weights"):
            make(Tied())
