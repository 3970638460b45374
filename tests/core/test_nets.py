from itertools import pairwise

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from torch import nn

from irl.core.nets import (
    CLIP,
    NO_CLIP,
    Normaliser,
    SpectralLinear,
    fitted_normaliser,
    linear,
    mixed_normaliser,
    mlp,
)
from irl.core.rng import torch_stream

columns = arrays(
    np.float32, st.tuples(st.integers(1, 30), st.just(3)), elements=st.floats(-100, 100, width=32)
)


@pytest.mark.parametrize(("name", "act"), [("tanh", np.tanh), ("relu", lambda x: np.maximum(x, 0))])
def test_a_perceptron_is_its_matrix_products(name: str, act) -> None:
    net = mlp((3, 5, 4, 2), name, torch_stream(0, "net"))
    x = torch.randn(7, 3, generator=torch_stream(0, "x"))
    weights = [parameter.detach().double().numpy() for parameter in net.parameters()]
    y = x.double().numpy()
    for i, (weight, bias) in enumerate(zip(weights[::2], weights[1::2], strict=True)):
        y = y @ weight.T + bias
        y = act(y) if i < 2 else y
    np.testing.assert_allclose(net(x).detach().numpy(), y, rtol=1e-5, atol=1e-6)


def test_without_hidden_layers_it_is_linear() -> None:
    net = mlp((3, 2), "tanh", torch_stream(0, "net"))
    assert [type(layer) for layer in net] == [nn.Linear]


def test_an_unknown_activation_is_refused() -> None:
    with pytest.raises(KeyError, match="gelu"):
        mlp((3, 5, 2), "gelu", torch_stream(0, "net"))


def test_weights_come_from_the_generator_alone() -> None:
    def weights(seed: int) -> torch.Tensor:
        return nn.utils.parameters_to_vector(mlp((3, 5, 2), "tanh", torch_stream(seed, "net")).parameters())

    first = weights(0)
    torch.rand(100)
    assert torch.equal(weights(0), first)
    assert not torch.equal(weights(1), first)


def test_weights_fill_the_interval_of_one_over_the_root_of_the_inputs() -> None:
    layer = linear(100, 400, torch_stream(0, "layer"))
    for values in (layer.weight.detach(), layer.bias.detach()):
        assert values.abs().max() <= 0.1
        assert values.max() > 0.098
        assert values.min() < -0.098
    # the standard deviation of a uniform one in +-1/10, within 1 % for 40 000 draws
    assert float(layer.weight.detach().std()) == pytest.approx(0.1 / np.sqrt(3), rel=0.01)


@given(columns, st.lists(st.integers(0, 30), max_size=4))
def test_moments_of_pieces_are_the_moments_of_the_whole(values: np.ndarray, cuts: list[int]) -> None:
    borders = [0, *sorted({min(cut, len(values)) for cut in cuts} - {0, len(values)}), len(values)]
    normaliser = Normaliser(3)
    for a, b in pairwise(borders):
        normaliser.update(torch.from_numpy(values[a:b]))
    exact = values.astype(np.float64)
    # the moments are float32 of values up to 100
    np.testing.assert_allclose(normaliser.mean.numpy(), exact.mean(0), atol=1e-4)
    np.testing.assert_allclose(normaliser.var.numpy(), exact.var(0), rtol=1e-5, atol=2e-3)
    assert normaliser.count == len(values)


def test_pieces_agree_closely_at_a_scale_of_one() -> None:
    values = 5 + torch.randn(1000, 2, generator=torch_stream(0, "x"))
    normaliser = Normaliser(2)
    for start in range(0, 1000, 37):
        normaliser.update(values[start : start + 37])
    exact = values.double().numpy()
    np.testing.assert_allclose(normaliser.mean.numpy(), exact.mean(0), rtol=1e-6)
    np.testing.assert_allclose(normaliser.var.numpy(), exact.var(0), rtol=3e-6)


def test_normalised_demonstrations_have_mean_0_and_deviation_1() -> None:
    values = 3 + 7 * torch.randn(500, 2, generator=torch_stream(0, "x"))
    out = fitted_normaliser(values)(values).double().numpy()
    np.testing.assert_allclose(out.mean(0), 0, atol=1e-5)
    np.testing.assert_allclose(out.std(0), 1, rtol=1e-5)


def test_a_constant_observation_is_only_centred() -> None:
    normaliser = fitted_normaliser(torch.tensor([[3.7, 1.0], [3.7, 3.0]]))
    assert normaliser.std.tolist() == [1.0, 1.0]
    shifted = normaliser(torch.tensor([[4.7, 2.0]]))
    np.testing.assert_allclose(shifted.numpy(), [[1.0, 0.0]], atol=1e-6)
    # a spread of rounding size is noise and is not blown up
    noisy = fitted_normaliser(torch.tensor([[0.0], [1e-7]]))
    assert float(noisy(torch.tensor([[1e-7]])).abs()) < 1e-6


def test_a_mixed_normaliser_has_the_moments_of_both_as_if_there_were_as_many_of_each() -> None:
    rng = np.random.default_rng(0)
    many, few = rng.normal(2.0, 0.1, (600, 3)), rng.normal(-5.0, [3.0, 1e-3, 7.0], (40, 3))
    mixed = mixed_normaliser(*(fitted_normaliser(torch.tensor(x, dtype=torch.float32)) for x in (many, few)))
    whole = np.concatenate([many, np.repeat(few, 15, axis=0)])
    np.testing.assert_allclose(mixed.mean.numpy(), whole.mean(0), rtol=1e-5)
    np.testing.assert_allclose(mixed.std.numpy(), whole.std(0), rtol=1e-5)
    assert mixed.count == 640


def test_outliers_are_clipped_on_both_sides() -> None:
    normaliser = fitted_normaliser(torch.tensor([[-1.0], [1.0]]))
    out = normaliser(torch.tensor([[1e9], [-1e9], [9.5], [-9.5]]))
    assert out[:, 0].tolist() == [CLIP, -CLIP, 9.5, -9.5]


def test_the_bound_is_in_deviations_and_the_callers() -> None:
    normaliser = Normaliser(1, clip=3.0)
    normaliser.update(torch.tensor([[3.0], [7.0]]))  # mean 5, deviation 2
    assert normaliser(torch.tensor([[100.0], [-100.0], [10.0]]))[:, 0].tolist() == [3.0, -3.0, 2.5]


def test_no_clip_lets_every_float32_through() -> None:
    largest = float(np.finfo(np.float32).max)
    x = torch.tensor([[50.0], [-1e30], [largest], [-largest]])
    assert torch.equal(Normaliser(1, NO_CLIP)(x), x)


def test_unfitted_it_changes_nothing_and_applying_it_never_moves_it() -> None:
    normaliser = Normaliser(2)
    x = torch.tensor([[1.5, -2.0]])
    assert torch.equal(normaliser(x), x)
    assert normaliser.mean.tolist() == [0.0, 0.0]
    assert float(normaliser.count) == 0.0


def test_the_moments_travel_in_the_state() -> None:
    fitted = fitted_normaliser(torch.tensor([[1.0, 5.0], [2.0, 9.0], [4.0, 9.0]]))
    other = Normaliser(2)
    other.load_state_dict(fitted.state_dict())
    more = torch.tensor([[0.0, 0.0]])
    fitted.update(more)
    other.update(more)
    assert torch.equal(other.mean, fitted.mean)
    assert torch.equal(other.var, fitted.var)


def spectral(inputs: int = 6, outputs: int = 4, seed: int = 0) -> SpectralLinear:
    return SpectralLinear(inputs, outputs, torch_stream(seed, "net"))


@pytest.mark.parametrize(("inputs", "outputs"), [(6, 4), (4, 6), (5, 1), (1, 5)])
def test_a_spectral_layer_is_divided_by_its_largest_singular_value(inputs: int, outputs: int) -> None:
    layer, x = spectral(inputs, outputs), torch.randn(7, inputs, generator=torch_stream(0, "x"))
    expected = x @ (layer.weight / torch.linalg.matrix_norm(layer.weight, 2)).T + layer.bias
    torch.testing.assert_close(layer(x), expected)


def test_it_follows_the_weights_as_they_move_and_nothing_moves_otherwise() -> None:
    layer, rng = spectral(), torch_stream(0, "steps")
    for _ in range(200):
        with torch.no_grad():
            layer.weight += 0.005 * torch.randn(layer.weight.shape, generator=rng)
        layer.iterate()
    exact = torch.linalg.matrix_norm(layer.weight, 2)
    estimate = layer.u @ layer.weight @ layer.v
    assert 0.99 < float((estimate / exact).detach()) <= 1 + 1e-6
    before = {name: value.clone() for name, value in layer.state_dict().items()}
    for mode in (True, False):
        layer.train(mode)(torch.ones(3, 6)).sum().backward()
    assert all(torch.equal(value, before[name]) for name, value in layer.state_dict().items())


def test_a_spectral_perceptron_lengthens_no_difference() -> None:
    net = mlp((6, 8, 8, 1), "tanh", torch_stream(0, "net"), spectral_norm=True)
    with torch.no_grad():
        for layer in list(net)[::2]:
            layer.get_parameter("weight").mul_(50.0)
    a, b = (3 * torch.randn(100, 6, generator=torch_stream(0, name)) for name in "ab")
    stretch = (net(a) - net(b)).norm(dim=1) / (a - b).norm(dim=1)
    assert 0.01 < float(stretch.max().detach()) <= 1 + 1e-5


def test_the_gradient_of_a_spectral_layer_is_that_of_the_exact_quotient() -> None:
    layer = spectral().double()
    x = torch.randn(7, 6, generator=torch_stream(0, "x"), dtype=torch.float64)
    for _ in range(200):  # u and v to the last digit of float64
        layer.iterate()
    (found,) = torch.autograd.grad(layer(x).square().sum(), layer.weight)
    quotient = layer.weight / torch.linalg.matrix_norm(layer.weight, 2)
    (expected,) = torch.autograd.grad((x @ quotient.T + layer.bias).square().sum(), layer.weight)
    torch.testing.assert_close(found, expected)


def test_where_the_power_method_is_travels_in_the_state_and_draws_nothing_global() -> None:
    before = torch.get_rng_state()
    layer, other = spectral(), spectral(seed=1)
    layer.iterate()
    assert torch.equal(torch.get_rng_state(), before)
    assert layer.state_dict().keys() == {"weight", "bias", "u", "v"}
    other.load_state_dict(layer.state_dict())
    x = torch.ones(2, 6)
    assert torch.equal(other(x), layer(x))
    for one in (layer, other):
        one.iterate()
    assert torch.equal(other.u, layer.u)
