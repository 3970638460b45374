"""AIRL's logit is f - log pi of the batch's own actions, and what it learns is a log density ratio."""

import math
from collections.abc import Callable
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
from irl.core.types import Transitions, concatenate
from irl.discriminators.airl import AIRL, AIRLConfig
from irl.envs.absorbing import absorb

# with a bound that no log pi here comes to, as in the paper
SMALL = AIRLConfig(hidden=(8,), potential_hidden=(6,), lr=1e-2, terminal="mask", log_pi_bound=10.0)
GAMMA = 0.9


def steps(obs: Tensor, action: Tensor) -> Transitions:
    flags = torch.zeros(len(obs), dtype=torch.bool)
    return Transitions(obs, action, obs + 0.1, flags, flags)


def gaussian(of_state: float, of_action: float, n: int, rng: torch.Generator) -> Transitions:
    return steps(of_state + torch.randn(n, 1, generator=rng), of_action + torch.randn(n, 1, generator=rng))


def standard_normal(batch: Transitions) -> Tensor:
    """The log density of N(0, 1) at the batch's own actions."""
    return -0.5 * batch.action[:, 0].square() - 0.5 * math.log(2 * math.pi)


def airl(
    config: AIRLConfig = SMALL,
    log_pi: Callable[[Transitions], Tensor] = standard_normal,
    seed: int = 0,
    normaliser: Normaliser | None = None,
) -> AIRL:
    return AIRL(
        1,
        1,
        config,
        log_pi=log_pi,
        gamma=GAMMA,
        normaliser=normaliser or Normaliser(1),
        init_rng=torch_stream(seed, "weights"),
        rng=torch_stream(seed, "rest"),
    )


def classes(n: int = 64) -> tuple[Transitions, Transitions]:
    rng = torch_stream(0, "classes")
    expert, policy = gaussian(0.5, 0.5, n, rng), gaussian(-0.5, 0.0, n, rng)
    return expert, replace(policy, terminated=torch.arange(n) % 9 == 8)


def weights(of: AIRL) -> Tensor:
    return torch.nn.utils.parameters_to_vector(of.net.parameters()).detach().clone()


def trained(updates: int, config: AIRLConfig = SMALL, seed: int = 0) -> AIRL:
    of, (expert, policy) = airl(config, seed=seed), classes()
    for _ in range(updates):
        of.update(expert, policy)
    return of


def test_at_the_optimum_the_logit_is_the_log_density_ratio_and_f_the_log_of_the_experts_density() -> None:
    """Expert s ~ N(m, 1), a ~ N(b, 1), policy s ~ N(-m, 1), a ~ N(0, 1): logit = 2 m s + b a - b^2 / 2."""
    m = b = 0.5
    rng = torch_stream(0, "samples")
    config = replace(SMALL, hidden=(16,), potential_hidden=(4,), gradient_penalty=0.0)
    of = airl(config)
    for update in range(500):
        if update == 350:
            of.optimizer.param_groups[0]["lr"] = 1e-3
        of.update(gaussian(m, b, 1024, rng), gaussian(-m, 0.0, 1024, rng))
    s, a = (x.reshape(-1, 1) for x in torch.meshgrid(*[torch.linspace(-1.5, 1.5, 7)] * 2, indexing="ij"))
    grid = steps(s, a)
    ratio = (2 * m * s + b * a - b * b / 2)[:, 0]
    logit = of.logits(grid).detach()
    assert float((logit - ratio).abs().mean()) < 0.15
    # f alone is the ratio and log pi: that is what does not move when the policy does
    torch.testing.assert_close(of.net.f(grid, GAMMA).detach(), logit + standard_normal(grid))


def test_the_logit_takes_off_log_pi_of_the_batchs_own_actions() -> None:
    of, (expert, _) = trained(20), classes()
    by_hand = of.net.f(expert, GAMMA) - standard_normal(expert)
    torch.testing.assert_close(of.logits(expert), by_hand)
    other = replace(expert, action=expert.action + 1.0)
    moved = of.logits(other) - of.net.f(other, GAMMA)
    assert not torch.allclose(moved, by_hand - of.net.f(expert, GAMMA))


def test_the_reward_is_log_d_minus_log_one_minus_d_without_a_gradient() -> None:
    of, (expert, _) = trained(50), classes()
    share = torch.sigmoid(of.logits(expert).detach().double())
    found = of.reward(expert)
    torch.testing.assert_close(found.double(), share.log() - (1 - share).log(), atol=1e-5, rtol=1e-4)
    assert not found.requires_grad
    assert float(found.min()) < 0.0 < float(found.max())


def test_with_reward_f_no_log_pi_is_paid() -> None:
    with_entropy, alone = airl(), airl(replace(SMALL, reward="f"))
    _, policy = classes()
    torch.testing.assert_close(alone.reward(policy), alone.net.f(policy, GAMMA).detach())
    torch.testing.assert_close(with_entropy.reward(policy), alone.reward(policy) - standard_normal(policy))


def test_it_has_a_g_and_an_h_that_both_learn_and_are_told_apart() -> None:
    before, after = airl(), trained(30)
    expert, _ = classes()
    for part in ("g", "h"):
        assert not torch.allclose(
            getattr(before.net, part)(expert), getattr(after.net, part)(expert), atol=1e-2
        )
    f = after.net.g(expert) + GAMMA * after.net.h(replace(expert, obs=expert.next_obs)) - after.net.h(expert)
    torch.testing.assert_close(after.net.f(expert, GAMMA), f)


def test_log_pi_is_asked_anew_at_each_update_for_expert_and_policy() -> None:
    asked: list[Transitions] = []

    def remember(batch: Transitions) -> Tensor:
        asked.append(batch)
        return standard_normal(batch)

    of, (expert, policy) = airl(log_pi=remember), classes()
    of.update(expert, policy)
    of.update(expert, policy)
    assert [batch is expert for batch in asked] == [True, False, True, False]


def test_log_pi_is_bounded_and_nothing_in_the_absorbing_state() -> None:
    def extreme(batch: Transitions) -> Tensor:
        return 1e6 * batch.action[:, 0]

    _, policy = classes()
    of = airl(replace(SMALL, terminal="absorbing"), log_pi=extreme)
    assert float(of.log_pi(policy).abs().max()) == 10.0
    absorbed = absorb(replace(policy, action=policy.action + 9.0))
    assert absorbed.absorbing is not None
    assert not of.log_pi(absorbed)[absorbed.absorbing].any()
    assert of.log_pi(absorbed)[~absorbed.absorbing].all()
    found = of.update(absorbed, absorbed)
    assert found["airl/log_pi_at_bound"] == pytest.approx(64 / 71)


def test_an_update_is_the_papers_loss_and_the_penalties_as_autograd_has_them() -> None:
    """What is written out by hand for speed, done slowly: f from the network, slopes from a graph."""
    config = replace(SMALL, reward_penalty=3.0, potential_penalty=2.0)
    of, slow, (expert, policy) = airl(config), airl(config), classes()
    rng, adam = torch_stream(0, "rest"), torch.optim.Adam(slow.net.parameters(), lr=config.lr)
    for _ in range(5):
        of.update(expert, policy)
        logits = [slow.net.f(b, GAMMA) - standard_normal(b) for b in (expert, policy)]
        loss = F.softplus(-logits[0]).mean() + F.softplus(logits[1]).mean()
        mix = torch.rand(64, 1, generator=rng)
        s, a, after, kept = (
            (mix * x + (1 - mix) * y).requires_grad_()
            for x, y in (
                (expert.obs, policy.obs),
                (expert.action, policy.action),
                (expert.next_obs, policy.next_obs),
                (torch.ones(64, 1), (~policy.terminated).float()[:, None]),
            )
        )
        g, h = slow.net.reward(torch.cat([s, a], 1)), slow.net.potential(s)
        f = g + GAMMA * kept.detach() * slow.net.potential(after) - h
        slopes = [
            torch.autograd.grad(y.sum(), x, create_graph=True) for y, x in ((f, (s, a, after)), (g, (s, a)))
        ]
        (of_h,) = torch.autograd.grad(h.sum(), s, create_graph=True)
        loss = loss + 10.0 * (torch.cat(slopes[0], 1).norm(dim=1) - 1.0).square().mean()
        loss = loss + 3.0 * torch.cat(slopes[1], 1).square().sum(1).mean() + 2.0 * of_h.square().sum(1).mean()
        adam.zero_grad()
        loss.backward()
        adam.step()
    torch.testing.assert_close(weights(of), weights(slow), atol=2e-5, rtol=1e-3)


def test_an_update_moves_no_normaliser_and_no_global_random_state() -> None:
    expert, policy = classes()
    normaliser = fitted_normaliser(expert.obs)
    before = {name: value.clone() for name, value in normaliser.state_dict().items()}
    at, numpy_at = torch.get_rng_state(), str(np.random.get_state())  # noqa: NPY002
    of = airl(normaliser=normaliser)
    for _ in range(3):
        of.update(expert, replace(policy, obs=policy.obs + 50.0))
        of.reward(policy)
    assert all(torch.equal(before[name], value) for name, value in normaliser.state_dict().items())
    assert torch.equal(torch.get_rng_state(), at)
    assert str(np.random.get_state()) == numpy_at  # noqa: NPY002


def test_the_loss_is_that_of_all_rows_before_the_step() -> None:
    """Of every row of the batch, unscaled, each at its own weight."""
    expert, policy = classes()
    of = airl()
    expected = (F.softplus(-of.logits(expert)).mean() + F.softplus(of.logits(policy)).mean()).detach()
    assert of.update(expert, policy)["discriminator/loss"] == pytest.approx(float(expected), rel=1e-5)
    doubled = concatenate([expert, expert[:32]])
    weighted = replace(expert, weight=torch.where(torch.arange(64) < 32, 2.0, 1.0))
    again = airl()
    of_expert, of_policy = again.logits(doubled).detach(), again.logits(policy).detach()
    expected = F.softplus(-of_expert).mean() + F.softplus(of_policy).mean()
    assert again.update(weighted, policy)["discriminator/loss"] == pytest.approx(float(expected), rel=1e-5)


def test_the_same_seeds_give_the_same_weights_and_it_goes_on_to_the_bit(tmp_path: Path) -> None:
    assert torch.equal(weights(trained(5)), weights(trained(5)))
    assert not torch.equal(weights(trained(5)), weights(trained(5, seed=1)))
    expert, policy = classes()
    of, other = trained(5), airl(seed=1)
    state.save(tmp_path, of.state_dict())
    other.load_state_dict(state.load(tmp_path))
    for _ in range(5):
        assert other.update(expert, policy) == of.update(expert, policy)
    assert torch.equal(weights(other), weights(of))
    assert torch.equal(other.reward(policy), of.reward(policy))


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"log_pi_bound": 0.0}, "log_pi_bound must be above 0, not 0.0"),
        ({"absorbing_scale": 0.0}, "absorbing_scale must be above 0"),
        ({"gradient_penalty": -1.0}, "gradient_penalty must be at least 0"),
    ],
)
def test_settings_that_make_no_sense_are_refused(setting: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        AIRLConfig(**setting)


def test_a_linear_rate_falls_to_nothing_and_a_constant_one_stays() -> None:
    linear = replace(SMALL, lr_schedule="linear")
    for config, remaining, moves in ((linear, 0.25, 0.25), (linear, 0.0, 0.0), (SMALL, 0.0, 1.0)):
        of = airl(config)
        before = weights(of)
        of.anneal(remaining)
        of.update(*classes())
        assert float((weights(of) - before).abs().max()) == pytest.approx(moves * SMALL.lr, rel=0.1, abs=1e-6)
