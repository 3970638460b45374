"""DAC's discriminator: its settings, and what GAIL's has when they are on."""

import copy
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from irl.core import state
from irl.core.config import from_json, to_json
from irl.core.nets import Normaliser, fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import RewardFn, Transitions, concatenate
from irl.discriminators.dac import DAC, DACConfig
from irl.discriminators.gail import GAIL, GAILConfig
from irl.envs.absorbing import absorb
from irl.rewards.maps import MAPS

SMALL = DACConfig(hidden=(8,), lr=1e-2)


def steps(obs: Tensor) -> Transitions:
    flags = torch.zeros(len(obs), dtype=torch.bool)
    return Transitions(obs, torch.zeros(len(obs), 1), obs, flags, flags)


def gaussian(mean: Tensor, n: int, rng: torch.Generator) -> Transitions:
    return steps(mean + torch.randn(n, len(mean), generator=rng))


def two_classes(n: int = 64) -> tuple[Transitions, Transitions]:
    rng = torch_stream(0, "classes")
    return gaussian(torch.tensor([1.0]), n, rng), gaussian(torch.tensor([-1.0]), n, rng)


def discriminator(config: GAILConfig = SMALL, seed: int = 0, obs_dim: int = 1, **kwargs) -> DAC:
    normaliser = kwargs.pop("normaliser", None) or Normaliser(obs_dim)
    rngs = {"init_rng": torch_stream(seed, "weights"), "rng": torch_stream(seed, "rest")}
    return DAC(obs_dim, 1, config, normaliser=normaliser, **rngs, **kwargs)


def weights(d: GAIL) -> Tensor:
    return torch.nn.utils.parameters_to_vector(d.net.parameters()).detach().clone()


def losses(d: GAIL, expert: Transitions, policy: Transitions, n: int) -> Iterator[dict[str, float]]:
    for _ in range(n):
        yield d.update(expert, policy)


def test_between_two_gaussians_the_logit_is_the_log_ratio_of_their_densities() -> None:
    """log N(x; m, 1) - log N(x; n, 1) = (m - n) x - (|m|^2 - |n|^2) / 2, in two dimensions."""
    m, n, rng = torch.tensor([1.0, -0.5]), torch.tensor([-0.5, 0.5]), torch_stream(0, "samples")
    normaliser = fitted_normaliser(gaussian(m, 10_000, rng).obs)
    config = DACConfig(hidden=(32,), lr=1e-2, gradient_penalty=0.0)
    d = discriminator(config, obs_dim=2, normaliser=normaliser)
    for update in range(600):
        if update == 400:
            d.optimizer.param_groups[0]["lr"] = 1e-3
        d.update(gaussian(m, 1024, rng), gaussian(n, 1024, rng))
    x = torch.cat([gaussian(mean, 500, rng).obs for mean in (m, n)])
    ratio = x @ (m - n) - (m.square().sum() - n.square().sum()) / 2
    error = (d.logits(steps(x)).detach() - ratio).abs()
    # the ratio itself ranges over +-6 with a deviation of 2.2
    assert float(error.mean()) < 0.15
    assert float(torch.corrcoef(torch.stack([d.logits(steps(x)).detach(), ratio]))[0, 1]) > 0.99


def test_the_defaults_are_dacs_and_survive_json() -> None:
    c = DACConfig()
    assert (c.hidden, c.activation, c.lr, c.gradient_penalty) == ((128, 128), "tanh", 3e-4, 10.0)
    assert (c.penalty_center, c.penalty_every, c.reward_map, c.absorbing_scale) == (1.0, 1, "logit", 10.0)
    assert (c.entropy, c.spectral_norm) == (0.0, False)
    changed = replace(c, reward_map="fairl", penalty_center=0.0, spectral_norm=True)
    assert from_json(DACConfig, to_json(changed)) == changed


def test_gails_defaults_know_no_absorbing_state_and_pay_gails_reward() -> None:
    c = GAILConfig()
    assert (c.reward_map, c.activation, c.absorbing_scale) == ("gail", "tanh", 0.0)
    assert (c.penalty_center, c.penalty_every, c.entropy, c.spectral_norm) == (1.0, 1, 0.0, False)


@pytest.mark.parametrize(
    "wrong", [{"penalty_center": -1.0}, {"penalty_every": 0}, {"entropy": -1.0}, {"absorbing_scale": -1.0}]
)
def test_settings_below_their_bound_are_refused(wrong) -> None:
    with pytest.raises(ValueError, match=f"{next(iter(wrong))} must be at least"):
        DACConfig(**wrong)


@pytest.mark.parametrize("reward_map", MAPS)
def test_the_reward_is_the_mapped_logit_without_a_gradient(reward_map) -> None:
    d, (expert, _) = discriminator(replace(SMALL, reward_map=reward_map)), two_classes()
    reward: RewardFn = d.reward
    torch.testing.assert_close(reward(expert), MAPS[reward_map](d.logits(expert).detach()))
    assert not reward(expert).requires_grad
    assert d.reward_map == reward_map


def test_the_absorbing_state_is_told_from_both_and_its_reward_learned() -> None:
    # the expert never ends, the policy always does: s_abs is the policy's
    expert, policy = two_classes()
    ended = absorb(replace(policy[:32], terminated=torch.ones(32, dtype=torch.bool)))
    d, s_abs = discriminator(), ended[32:]
    list(losses(d, expert, ended, 300))
    assert float(d.reward(s_abs).max()) < float(d.reward(policy).mean()) < float(d.reward(expert).mean())
    # the same state on both sides tells nothing
    both = discriminator()
    list(losses(both, concatenate([expert, s_abs]), concatenate([policy, s_abs]), 100))
    assert float(both.reward(s_abs).abs().max()) < 0.2


def test_raw_terminations_are_paid_by_gamma_and_absorbed_ones_by_their_rows() -> None:
    d, (expert, _) = discriminator(gamma=0.5), two_classes(6)
    ended = replace(expert, terminated=torch.arange(6) == 5)
    of_abs = float(d.reward(absorb(ended))[6])
    found = d.reward(ended) - d.reward(expert)
    # 0.5 / (1 - 0.5) = 1
    assert found.tolist() == pytest.approx([0.0] * 5 + [of_abs], abs=1e-5)
    assert torch.equal(d.reward(absorb(ended))[:6], d.reward(expert))


def test_weights_of_rows_are_in_the_loss() -> None:
    expert, policy = two_classes()
    first = torch.arange(64) < 32
    alone, weighted = discriminator(), discriminator()
    for d in (alone, weighted):
        d.config = replace(d.config, gradient_penalty=0.0)
    half = alone.update(expert[first], policy)["discriminator/loss"]
    found = weighted.update(replace(expert, weight=first.float()), policy)["discriminator/loss"]
    assert found == pytest.approx(half, rel=1e-5)
    torch.testing.assert_close(weights(weighted), weights(alone), rtol=0, atol=1e-5)


def test_expert_and_policy_are_normalised_by_the_same_moments_that_nothing_moves() -> None:
    expert, policy = two_classes()
    far = replace(policy, obs=50 + 20 * policy.obs)
    normaliser = fitted_normaliser(expert.obs)
    d = discriminator(normaliser=normaliser)
    before = {name: value.clone() for name, value in normaliser.state_dict().items()}
    for _ in range(3):
        d.update(expert, far)
        d.reward(far)
    assert all(torch.equal(value, before[name]) for name, value in normaliser.state_dict().items())
    std = expert.obs.std(0, unbiased=False)
    for batch in (expert, far):
        by_hand = ((batch.obs - expert.obs.mean(0)) / std).clamp(-10, 10)
        torch.testing.assert_close(d.net.inputs(batch)[:, :1], by_hand, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("k", [1, 3])
def test_the_penalty_is_taken_every_kth_update_with_k_times_its_weight(k: int) -> None:
    expert, policy = two_classes()
    config = replace(SMALL, penalty_every=k, gradient_penalty=7.0)
    lazy, plain = discriminator(config), discriminator(replace(config, gradient_penalty=0.0))
    eager = discriminator(replace(config, penalty_every=1, gradient_penalty=7.0 * k))
    assert lazy.update(expert, policy) == eager.update(expert, policy)
    assert torch.equal(weights(lazy), weights(eager))
    reported = []
    for update in range(1, 2 * k + 1):
        for other in (plain, eager):
            other.load_state_dict(copy.deepcopy(lazy.state_dict()) | {"updates": 0})
        reported.append(lazy.update(expert, policy)["discriminator/gradient_penalty"])
        (eager if update % k == 0 else plain).update(expert, policy)
        torch.testing.assert_close(weights(lazy), weights(eager if update % k == 0 else plain))
    # between two it is the last one taken that is reported
    assert len(set(reported)) == (2 if k == 1 else 3)


def test_the_entropy_bonus_keeps_it_less_sure() -> None:
    expert, policy = two_classes()
    certainty = []
    for weight in (0.0, 0.5):
        d = discriminator(replace(SMALL, gradient_penalty=0.0, entropy=weight))
        list(losses(d, expert, policy, 150))
        certainty.append(float(d.logits(expert).detach().abs().mean()))
    assert certainty[1] < 0.8 * certainty[0]


def test_spectral_norm_bounds_the_slope_where_nothing_else_does() -> None:
    expert, policy = steps(torch.full((64, 1), 5.0)), steps(torch.full((64, 1), -5.0))
    slopes = []
    for normed in (True, False):
        config = replace(SMALL, lr=1e-1, gradient_penalty=0.0, spectral_norm=normed)
        d = discriminator(config)
        list(losses(d, expert, policy, 100))
        gap = d.logits(steps(torch.linspace(-5, 5, 101)[:, None])).detach().diff()
        slopes.append(float(gap.abs().max()) / 0.1)
    assert slopes[0] <= 1.02
    assert slopes[1] > 1.5


@pytest.mark.parametrize(
    "config",
    [SMALL, replace(SMALL, spectral_norm=True, activation="relu"), replace(SMALL, penalty_every=3)],
    ids=["plain", "spectral", "lazy"],
)
def test_it_goes_on_where_it_was_to_the_bit(tmp_path: Path, config: DACConfig) -> None:
    expert, policy = two_classes()
    d, other = discriminator(config), discriminator(config, seed=1)
    list(losses(d, expert, policy, 4))
    state.save(tmp_path, d.state_dict())
    other.load_state_dict(state.load(tmp_path))
    for _ in range(5):
        assert other.update(expert, policy) == d.update(expert, policy)
    assert torch.equal(weights(other), weights(d))
    assert torch.equal(other.reward(policy), d.reward(policy))


def test_the_global_random_state_is_neither_read_nor_moved() -> None:
    expert, policy = two_classes()
    config = replace(SMALL, spectral_norm=True)

    def trained() -> Tensor:
        d = discriminator(config)
        list(losses(d, expert, policy, 3))
        d.reward(policy)
        return weights(d)

    expected = trained()
    torch.rand(100)
    before, numpy_before = torch.get_rng_state(), str(np.random.get_state())  # noqa: NPY002
    assert torch.equal(trained(), expected)
    assert torch.equal(torch.get_rng_state(), before)
    assert str(np.random.get_state()) == numpy_before  # noqa: NPY002
