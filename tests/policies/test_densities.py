"""Log densities of the actions that an environment saw: they sum to one, and ask no one to act anew."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor
from torch.special import log_ndtr

from irl.core.types import Transitions
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.policies import densities
from tests import pointmass  # noqa: F401 (registers the tasks)

LOW, HIGH = torch.tensor([-2.0]), torch.tensor([1.0])
MOST = torch.finfo(torch.float32).max
PPO = PPOConfig(n_envs=2, steps_per_round=128, batch_size=64, n_epochs=2, hidden=(16,))
SAC = SACConfig(steps_per_round=100, learning_starts=60, batch_size=16, hidden=(16,))

means = st.floats(-4.0, 4.0)
log_stds = st.floats(-2.5, 1.0)


def clipped(action: Tensor, mean: float, log_std: float) -> Tensor:
    column = action.reshape(-1, 1)
    shape = torch.full_like(column, mean), torch.full_like(column, log_std)
    return densities.clipped(column, *shape, LOW.to(column), HIGH.to(column))


@settings(max_examples=30, deadline=None)
@given(means, log_stds)
def test_clipped_is_a_density_inside_and_a_mass_at_each_bound_and_sums_to_one(mean, log_std) -> None:
    margin = densities.EDGE * 3.0
    inside = torch.linspace(-2.0 + margin, 1.0 - margin, 4001, dtype=torch.float64)
    # the middles of the cells: at the ends it is a mass already
    cells = (inside[1:] + inside[:-1]) / 2
    area = float(clipped(cells, mean, log_std).exp().sum() * (inside[1] - inside[0]))
    masses = clipped(torch.tensor([-2.0, 1.0], dtype=torch.float64), mean, log_std).exp()
    assert area + float(masses.sum()) == pytest.approx(1.0, abs=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.floats(-1.5, 1.5), st.floats(-2.0, 0.0), st.floats(0.3, 3.0))
def test_squashed_integrates_to_one_over_the_box_of_the_environment(mean, log_std, half) -> None:
    u = torch.linspace(-7.0, 7.0, 20_001, dtype=torch.float64)
    action = u.tanh()
    of = torch.full_like(action, mean)[:, None], torch.full_like(action, log_std)[:, None]
    density = densities.squashed(action[:, None], *of, torch.tensor([half], dtype=torch.float64)).exp()
    assert float(torch.trapezoid(density, half * action)) == pytest.approx(1.0, abs=1e-3)


def test_clipped_is_how_often_clipped_samples_fall_there() -> None:
    rng = np.random.default_rng(0)
    mean, log_std = 0.8, -0.3
    seen = np.clip(mean + math.exp(log_std) * rng.standard_normal(200_000), -2.0, 1.0)
    at_bound = float(clipped(torch.tensor([1.0]), mean, log_std).exp())
    assert at_bound == pytest.approx(float((seen >= 1.0 - 3.0 * densities.EDGE).mean()), abs=0.01)
    near = float((np.abs(seen - 0.3) < 0.05).mean()) / 0.1
    assert float(clipped(torch.tensor([0.3]), mean, log_std).exp()) == pytest.approx(near, abs=0.02)


@pytest.mark.parametrize("bounds", [(0.0, math.inf), (-math.inf, 2.0), (-MOST, MOST), (-math.inf, math.inf)])
def test_clipped_is_the_density_itself_inside_a_box_without_end(bounds: tuple[float, float]) -> None:
    action = torch.tensor([[0.3], [1.7]])
    mean, log_std = torch.full((2, 1), 0.2, requires_grad=True), torch.full((2, 1), -0.7, requires_grad=True)
    found = densities.clipped(action, mean, log_std, *(torch.tensor([bound]) for bound in bounds))
    expected = torch.distributions.Normal(mean, log_std.exp()).log_prob(action).squeeze(1)
    torch.testing.assert_close(found, expected)
    slopes = torch.autograd.grad(found.sum(), (mean, log_std))
    torch.testing.assert_close(slopes, torch.autograd.grad(expected.sum(), (mean, log_std)))


def test_a_bound_there_is_has_its_mass_where_the_other_is_not_there() -> None:
    low, high = torch.tensor([0.0]), torch.tensor([math.inf])
    zero = torch.zeros(1, 1)
    mass = densities.clipped(zero, zero - 0.5, zero, low, high)
    assert float(mass) == pytest.approx(math.log(0.5 * math.erfc(-0.5 / math.sqrt(2.0))), abs=1e-6)


def test_in_a_box_with_ends_clipped_is_its_equation_to_the_bit() -> None:
    rng = torch.Generator().manual_seed(0)
    mean, log_std, action = (scale * torch.randn(4000, 1, generator=rng) for scale in (3.0, 1.0, 2.0))
    action = action.clamp(LOW, HIGH)
    margin, std = densities.EDGE * (HIGH - LOW), log_std.exp()
    low, high = LOW + margin, HIGH - margin
    inside = -0.5 * ((action - mean) / std).square() - log_std - 0.5 * math.log(2.0 * math.pi)
    at_low, at_high = log_ndtr((low - mean) / std), log_ndtr((mean - high) / std)
    expected = torch.where(action <= low, at_low, torch.where(action >= high, at_high, inside)).squeeze(1)
    assert torch.equal(densities.clipped(action, mean, log_std, LOW, HIGH), expected)


def test_a_mean_far_outside_costs_no_log_density_at_the_bound() -> None:
    """What a Gaussian's density at the clipped action would: there it is below -1000, and falling."""
    found = [float(clipped(torch.tensor([1.0]), mean, -1.0)) for mean in (1.5, 3.0, 20.0)]
    assert found == sorted(found)
    assert found[-1] == pytest.approx(0.0, abs=1e-6)


def test_squashed_keeps_its_digits_where_tanh_has_none_and_is_finite_at_the_bound() -> None:
    u = torch.linspace(-6.0, 6.0, 25)
    ones, half = torch.ones(25, 1), torch.ones(1)
    exact = u.double()
    expected = (
        -0.5 * (exact - 1).square() - 0.5 * math.log(2 * math.pi) - torch.log(1 - exact.tanh().square())
    )
    # float32's tanh keeps u to a hundredth at 6
    found = densities.squashed(u.tanh()[:, None], ones, 0 * ones, half)
    torch.testing.assert_close(found.double(), expected, atol=0.1, rtol=0.02)
    at_bounds = torch.tensor([[-1.0], [1.0]])
    assert torch.isfinite(densities.squashed(at_bounds, ones[:2], ones[:2], half)).all()


def test_squashed_knows_the_scale_of_the_actions() -> None:
    action, zeros = torch.tensor([[0.3, -0.2]]), torch.zeros(1, 2)
    ratio = densities.squashed(action, zeros, zeros, torch.tensor([2.0, 0.5])) - densities.squashed(
        action, zeros, zeros, torch.ones(2)
    )
    assert float(ratio) == pytest.approx(-math.log(2.0) - math.log(0.5), abs=1e-6)
    wide = densities.squashed(action, zeros, zeros, torch.tensor([3.0, 1.0]))
    assert float(wide - densities.squashed(action, zeros, zeros, torch.ones(2))) == pytest.approx(
        -math.log(3)
    )


def a_ppo(env_id: str = "PointMass-v0") -> PPOLearner:
    # without a normaliser of its own it has a running one, which could be moved
    return PPOLearner(env_id, [0, 1], replace(PPO, log_std_init=0.5), seed=0, total_steps=1024)


def a_sac(env_id: str = "Pendulum-v1") -> SACLearner:
    return SACLearner(env_id, [0], SAC, seed=0, total_steps=400)


def zeros(batch: Transitions) -> Tensor:
    return torch.zeros(len(batch))


def test_ppos_log_pi_is_that_of_the_batchs_own_clipped_actions() -> None:
    ours = a_ppo()
    batch = ours.collect()
    drawn = torch.from_numpy(ours.model.rollout_buffer.actions).reshape(-1, 2)
    by_sb3 = torch.from_numpy(ours.model.rollout_buffer.log_probs).reshape(-1)
    inside = (drawn.abs() < 1.0 - 2.0 * densities.EDGE).all(1)
    assert 0.05 < float(inside.float().mean()) < 0.95
    torch.testing.assert_close(ours.log_pi(batch)[inside], by_sb3[inside], atol=1e-4, rtol=1e-4)
    # the others are masses: SB3's density of what was drawn is of something nobody saw
    with torch.no_grad():
        normal = ours.model.policy.get_distribution(batch.obs).distribution
    assert isinstance(normal, torch.distributions.Normal)
    mean = normal.mean
    std = math.exp(0.5)
    row = int((~inside).nonzero()[0])
    by_hand = 0.0
    for a, m in zip(batch.action[row].tolist(), mean[row].tolist(), strict=True):
        normal = torch.distributions.Normal(m, std)
        edge = 1.0 - 2.0 * densities.EDGE
        mass = (
            float(normal.cdf(torch.tensor(-edge)))
            if a <= -edge
            else 1.0 - float(normal.cdf(torch.tensor(edge)))
        )
        by_hand += math.log(mass) if abs(a) >= edge else float(normal.log_prob(torch.tensor(a)))
    assert float(ours.log_pi(batch[row : row + 1])) == pytest.approx(by_hand, abs=1e-4)


def test_sacs_log_pi_is_that_of_the_batchs_own_actions_in_environment_units() -> None:
    ours = a_sac()
    ours.start(zeros)
    ours.collect()
    batch = ours.collect()
    mean, log_std, _ = ours.model.actor.get_action_dist_params(batch.obs)
    u = torch.atanh((batch.action / 2.0).clamp(-1 + densities.OPEN, 1 - densities.OPEN))
    normal = torch.distributions.Normal(mean, log_std.exp())
    slope = 2.0 * (1.0 - u.tanh().square())  # da/du, the torque being within +-2
    by_hand = (normal.log_prob(u) - slope.log()).sum(1).detach()
    kept = (batch.action.abs() < 1.99).all(1)
    assert kept.sum() > 20
    torch.testing.assert_close(ours.log_pi(batch)[kept], by_hand[kept], atol=1e-3, rtol=1e-3)


def test_the_log_pi_of_a_learner_is_the_density_that_its_own_actions_have() -> None:
    """E over its own actions of q / p is 1 for every density q: here, that of the next learner."""
    ours, other = a_sac(), SACLearner("Pendulum-v1", [0], SAC, seed=5, total_steps=400)
    obs = torch.tensor([[1.0, 0.0, 0.5]]).expand(20_000, 3)
    with torch.no_grad():
        action = ours._update.inputs.unscaled(ours._update.sample(ours._update.inputs.features(obs)))
    never = torch.zeros(len(obs), dtype=torch.bool)
    batch = Transitions(obs, action, obs, never, never)
    ratio = (other.log_pi(batch) - ours.log_pi(batch)).exp()
    assert float(ratio.mean()) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("make", [a_ppo, a_sac], ids=["ppo", "sac"])
def test_asking_for_log_pi_changes_nothing(make) -> None:
    """No normaliser, no weight and no random state; and there is no gradient to follow."""
    ours = make()
    ours.start(zeros)
    batch = ours.collect()
    before = {name: value.clone() for name, value in ours.model.policy.state_dict().items()}
    at, numpy_at = torch.get_rng_state(), str(np.random.get_state())  # noqa: NPY002
    far = replace(batch, obs=batch.obs + 30.0)
    found = [ours.log_pi(batch), ours.log_pi(far), ours.log_pi(batch)]
    assert torch.equal(found[0], found[2])
    assert not found[0].requires_grad
    assert all(torch.equal(before[name], value) for name, value in ours.model.policy.state_dict().items())
    assert torch.equal(torch.get_rng_state(), at)
    assert str(np.random.get_state()) == numpy_at  # noqa: NPY002
