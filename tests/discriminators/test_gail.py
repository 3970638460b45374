import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import torch.nn.functional as F
from torch import Tensor

from irl.core import state
from irl.core.nets import Normaliser, fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import RewardFn, Transitions
from irl.discriminators.gail import GAIL, GAILConfig

SMALL = GAILConfig(hidden=(8,), lr=1e-2)


def steps(obs: Tensor, action: Tensor | None = None) -> Transitions:
    flags = torch.zeros(len(obs), dtype=torch.bool)
    action = torch.zeros(len(obs), 1) if action is None else action
    return Transitions(obs, action, obs, flags, flags)


def gaussian(mean: float, n: int, rng: torch.Generator) -> Transitions:
    return steps(mean + torch.randn(n, 1, generator=rng))


def two_classes(n: int = 64) -> tuple[Transitions, Transitions]:
    rng = torch_stream(0, "classes")
    return gaussian(1.0, n, rng), gaussian(-1.0, n, rng)


def discriminator(config: GAILConfig = SMALL, seed: int = 0, normaliser: Normaliser | None = None) -> GAIL:
    return GAIL(
        1,
        1,
        config,
        normaliser=normaliser or Normaliser(1),
        init_rng=torch_stream(seed, "weights"),
        rng=torch_stream(seed, "rest"),
    )


def trained(updates: int, config: GAILConfig = SMALL, seed: int = 0) -> GAIL:
    d, (expert, policy) = discriminator(config, seed), two_classes()
    for _ in range(updates):
        d.update(expert, policy)
    return d


def weights(d: GAIL) -> Tensor:
    return torch.nn.utils.parameters_to_vector(d.net.parameters()).detach().clone()


@pytest.mark.parametrize("m", [0.5, 1.0])
def test_between_two_gaussians_the_optimal_logit_is_2_m_x(m: float) -> None:
    """log N(x; m, 1) - log N(x; -m, 1) = 2 m x, whatever the normaliser."""
    rng = torch_stream(0, "samples")
    normaliser = fitted_normaliser(gaussian(m, 10_000, rng).obs)
    config = GAILConfig(hidden=(16,), lr=1e-2, gradient_penalty=0.0)
    d = discriminator(config, normaliser=normaliser)
    for update in range(600):
        if update == 400:
            d.optimizer.param_groups[0]["lr"] = 1e-3
        d.update(gaussian(m, 1024, rng), gaussian(-m, 1024, rng))
    x = torch.linspace(-2, 2, 21)
    error = (d.logits(steps(x[:, None])).detach() - 2 * m * x).abs()
    # a tenth of the largest logit, which is at the edge, where steps are rare
    assert float(error.max()) < 0.1 * 4 * m
    assert float(error.mean()) < 0.1


def test_the_expert_gets_the_higher_logit_and_the_higher_reward() -> None:
    d, (expert, policy) = trained(50), two_classes()
    assert float(d.logits(expert).mean().detach()) > 0.4 > -0.4 > float(d.logits(policy).mean().detach())
    assert float(d.reward(expert).mean()) > float(d.reward(policy).mean()) + 0.3


def test_the_reward_is_minus_log_one_minus_d_without_a_gradient() -> None:
    d, (expert, _) = trained(50), two_classes()
    reward: RewardFn = d.reward
    share = torch.sigmoid(d.logits(expert).detach().double())
    torch.testing.assert_close(reward(expert).double(), -torch.log(1 - share), rtol=1e-5, atol=1e-6)
    assert not reward(expert).requires_grad
    assert d.logits(expert).requires_grad
    assert float(reward(expert).min()) > 0


def test_the_loss_falls_from_log_4_and_is_reported_before_the_step() -> None:
    d, (expert, policy) = discriminator(), two_classes()
    blind = discriminator()
    with torch.no_grad():
        for parameter in blind.net.parameters():
            parameter.zero_()
    first = blind.update(expert, policy)
    without = discriminator(GAILConfig(hidden=(8,), gradient_penalty=0.0)).update(expert, policy)
    assert without["discriminator/gradient_penalty"] == 0.0
    assert first["discriminator/loss"] == pytest.approx(np.log(4), rel=1e-6)
    assert first["discriminator/gradient_penalty"] == pytest.approx(1.0)
    losses = [d.update(expert, policy)["discriminator/loss"] for _ in range(50)]
    assert losses[-1] < 0.75 * losses[0]


def test_the_penalty_holds_the_slope_near_one() -> None:
    # far apart, so that without a penalty the slope has no end
    expert, policy = steps(torch.full((64, 1), 5.0)), steps(torch.full((64, 1), -5.0))
    found = []
    for weight in (10.0, 0.0):
        d = discriminator(GAILConfig(hidden=(), lr=1e-1, gradient_penalty=weight))
        for _ in range(200):
            d.update(expert, policy)
        found.append(float(next(d.net.body.parameters()).norm().detach()))
    assert found[0] == pytest.approx(1.0, abs=0.1)
    assert found[1] > 1.5


def test_an_update_moves_no_normaliser() -> None:
    normaliser = fitted_normaliser(two_classes()[0].obs)
    before = copy.deepcopy(normaliser.state_dict())
    d = discriminator(normaliser=normaliser)
    rng = torch_stream(0, "far")
    for _ in range(3):
        d.update(gaussian(7.0, 32, rng), gaussian(-9.0, 32, rng))
        d.reward(gaussian(30.0, 32, rng))
    assert all(torch.equal(normaliser.state_dict()[name], before[name]) for name in before)


def test_expert_and_policy_are_normalised_alike() -> None:
    expert, _ = two_classes()
    d = discriminator(normaliser=fitted_normaliser(expert.obs))
    d.update(expert, steps(expert.obs + 3))
    assert torch.equal(d.net.inputs(expert)[:, :1], d.net.normaliser(expert.obs))
    # the same steps under both labels cannot be told apart: blind is the best there is
    alike = discriminator(normaliser=fitted_normaliser(expert.obs))
    losses = [alike.update(expert, expert)["discriminator/loss"] for _ in range(30)]
    assert losses[-1] == pytest.approx(np.log(4), abs=0.02)
    assert min(losses) >= np.log(4) - 1e-6


def test_the_same_seeds_give_the_same_weights_to_the_bit() -> None:
    assert torch.equal(weights(trained(5)), weights(trained(5)))
    assert not torch.equal(weights(trained(5)), weights(trained(5, seed=1)))


def test_the_global_random_state_is_neither_read_nor_moved() -> None:
    expected = weights(trained(5))
    torch.rand(100)
    torch_before, numpy_before = torch.get_rng_state(), str(np.random.get_state())  # noqa: NPY002
    assert torch.equal(weights(trained(5)), expected)
    trained(1).reward(two_classes()[0])
    assert torch.equal(torch.get_rng_state(), torch_before)
    assert str(np.random.get_state()) == numpy_before  # noqa: NPY002


def test_it_goes_on_where_it_was_to_the_bit(tmp_path: Path) -> None:
    expert, policy = two_classes()
    d = trained(5)
    state.save(tmp_path, d.state_dict())
    other = discriminator(seed=1, normaliser=fitted_normaliser(expert.obs))
    other.load_state_dict(state.load(tmp_path))
    for _ in range(5):
        assert other.update(expert, policy) == d.update(expert, policy)
    assert torch.equal(weights(other), weights(d))
    assert torch.equal(other.reward(policy), d.reward(policy))
    # five fresh updates from the same weights, without Adam's moments, end elsewhere
    forgetful = trained(5)
    forgetful.optimizer = torch.optim.Adam(forgetful.net.parameters(), lr=SMALL.lr)
    for _ in range(5):
        forgetful.update(expert, policy)
    assert not torch.equal(weights(forgetful), weights(d))


@pytest.mark.parametrize(
    ("config", "center"),
    [
        (SMALL, 1.0),
        (GAILConfig(hidden=(8, 6), lr=1e-2), 1.0),
        (GAILConfig(hidden=(8, 6), lr=1e-2, activation="relu", penalty_center=0.0), 0.0),
        (GAILConfig(hidden=(), lr=1e-2), 1.0),
    ],
)
def test_twenty_updates_are_the_papers_loss_and_one_penalty_as_autograd_has_them(config, center) -> None:
    """The same steps written out; what is left is the order in which float32 adds up."""
    expert, policy = two_classes()
    d, by_hand = discriminator(config), discriminator(config)
    rng, adam = torch_stream(0, "rest"), torch.optim.Adam(by_hand.net.parameters(), lr=1e-2)
    before = weights(d)
    for _ in range(20):
        d.update(expert, policy)
        of, expert_x, policy_x = by_hand.net.of_inputs, by_hand.net.inputs(expert), by_hand.net.inputs(policy)
        loss = F.softplus(-of(expert_x)).mean() + F.softplus(of(policy_x)).mean()
        mix = torch.rand(64, 1, generator=rng)
        x = (mix * expert_x + (1.0 - mix) * policy_x).requires_grad_(True)
        (gradient,) = torch.autograd.grad(of(x).sum(), x, create_graph=True)
        adam.zero_grad()
        (loss + 5.0 * (gradient.norm(dim=1) - center).square().mean()).backward()
        adam.step()
    torch.testing.assert_close(weights(d), weights(by_hand), rtol=0.0, atol=2e-5)
    assert float((weights(d) - before).abs().max()) > 0.05


def test_bfloat16_products_follow_float32_ones_without_equalling_them() -> None:
    exact, rounded = (
        trained(20, GAILConfig(hidden=(16, 16), lr=1e-2, products=products))
        for products in ("float32", "bfloat16")
    )
    start = weights(discriminator(GAILConfig(hidden=(16, 16))))
    off, way = (weights(rounded) - weights(exact)).norm(), (weights(exact) - start).norm()
    assert 0.0 < off < 0.2 * way
    # what judges is float32, of the weights that were trained
    _, policy = two_classes()
    again = discriminator(GAILConfig(hidden=(16, 16)), seed=1)
    again.net.load_state_dict(rounded.net.state_dict())
    assert torch.equal(again.reward(policy), rounded.reward(policy))


def test_a_discriminator_goes_on_from_its_state_with_bfloat16_products_too() -> None:
    config = GAILConfig(hidden=(16, 16), products="bfloat16")
    d, (expert, policy) = trained(5, config), two_classes()
    other = discriminator(config, seed=1)
    other.load_state_dict(copy.deepcopy(d.state_dict()))
    for _ in range(3):
        assert other.update(expert, policy) == d.update(expert, policy)
    assert torch.equal(weights(other), weights(d))


def test_a_copy_is_refused_because_it_would_train_weights_that_do_not_judge() -> None:
    with pytest.raises(TypeError, match="tied to its modules' weights"):
        copy.deepcopy(discriminator())


def test_a_linear_rate_falls_to_nothing_and_a_constant_one_stays() -> None:
    linear, constant = replace(SMALL, lr_schedule="linear"), SMALL
    for config, remaining, moves in (
        (linear, 1.0, 1.0),
        (linear, 0.25, 0.25),
        (linear, 0.0, 0.0),
        (constant, 0.0, 1.0),
    ):
        d = discriminator(config)
        before = weights(d)
        d.anneal(remaining)
        d.update(*two_classes())
        # Adam's first step is of the size of its rate
        assert float((weights(d) - before).abs().max()) == pytest.approx(moves * SMALL.lr, abs=1e-4)
