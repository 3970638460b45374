"""The equations of SAC on numbers worked out by hand, and densities against a grid."""

import math

import pytest
import torch

from irl.learners.sac_losses import (
    actor_loss,
    critic_loss,
    mean_alive,
    soft_value,
    squashed,
    td_target,
    temperature_loss,
)


@pytest.mark.parametrize(("mean", "log_std"), [(0.0, -0.5), (0.7, -1.0), (-0.4, 0.2)])
def test_the_squashed_density_integrates_to_one(mean: float, log_std: float) -> None:
    action = torch.linspace(-1 + 1e-4, 1 - 1e-4, 200_001, dtype=torch.float64)
    mean_, log_std_ = torch.full((200_001, 1), mean).double(), torch.full((200_001, 1), log_std).double()
    noise = (torch.atanh(action)[:, None] - mean_) / log_std_.exp()
    again, log_pi = squashed(mean_, log_std_, noise)
    torch.testing.assert_close(again[:, 0], action)
    assert torch.trapezoid(log_pi.exp(), action).item() == pytest.approx(1.0, abs=2e-3)


def test_a_target_bootstraps_unless_the_task_ended() -> None:
    target = td_target(torch.tensor([1.0, 1.0]), torch.tensor([4.0, 4.0]), torch.tensor([False, True]), 0.5)
    assert target.tolist() == [3.0, 1.0]


def test_nobody_acts_where_alive_is_zero() -> None:
    alive = torch.tensor([1.0, 0.0])
    value = soft_value(torch.tensor([2.0, 2.0]), torch.tensor([3.0, 3.0]), torch.tensor(0.5), alive)
    assert value.tolist() == [0.5, 2.0]
    q, log_pi = torch.tensor([1.0, 100.0]), torch.tensor([2.0, 100.0])
    assert actor_loss(q, log_pi, torch.tensor(0.5), alive).item() == 0.0
    assert temperature_loss(torch.tensor([2.0]), log_pi, -1.0, alive).item() == -2.0
    assert mean_alive(q, torch.zeros(2)).item() == 0.0


def test_critics_are_summed_and_halved() -> None:
    loss = critic_loss(torch.tensor([[1.0, 3.0], [0.0, 0.0]]), torch.tensor([0.0, 0.0]))
    assert loss.item() == pytest.approx(0.5 * (5.0 + 0.0))


def test_far_in_the_tails_the_density_stays_finite() -> None:
    _, log_pi = squashed(torch.full((1, 1), 20.0), torch.zeros(1, 1), torch.zeros(1, 1))
    assert math.isfinite(log_pi.item())
