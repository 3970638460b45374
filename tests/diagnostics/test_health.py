"""Discriminators of which the optimum is known: two Gaussians at +m and -m, logit 2 m x."""

import math

import numpy as np
import pytest
import torch
from scipy.integrate import quad
from scipy.stats import norm

from irl.core.rng import stream, torch_stream
from irl.core.types import Transitions
from irl.diagnostics.calibration import calibration
from irl.diagnostics.health import health
from irl.diagnostics.steepness import steepness

M = 0.6


def logits(scale: float = 1.0, n: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    rng = stream(0, "gaussians")
    # other numbers of each: both count the same
    return 2 * M * scale * rng.normal(M, 1, n), 2 * M * scale * rng.normal(-M, 1, n // 4)


def divergence() -> float:
    """JSD of the two, nats, by integration."""

    def part(x: float) -> float:
        p, q = norm.pdf(x, M), norm.pdf(x, -M)
        return float(0.5 * p * math.log(2 * p / (p + q)) + 0.5 * q * math.log(2 * q / (p + q)))

    return quad(part, -9, 9)[0]


def test_the_optimal_discriminator_is_calibrated_and_its_bound_is_tight() -> None:
    found = health(*logits())
    assert found.ece < 0.015
    assert found.reliability < 4e-4
    assert found.brier == pytest.approx(found.reliability - found.resolution + 0.25, abs=0.003)
    assert found.jsd_bound == pytest.approx(divergence(), abs=0.01)
    assert found.auroc == pytest.approx(norm.cdf(2 * M / math.sqrt(2)), abs=0.01)
    assert found.balanced_accuracy == pytest.approx(norm.cdf(M), abs=0.01)
    # of a calibrated D the entropy is what is left of the bce
    assert found.entropy == pytest.approx(found.bce, abs=0.01)


def test_one_that_is_too_sure_tells_as_well_and_means_less() -> None:
    calibrated, sure = health(*logits()), health(*logits(4))
    assert sure.auroc == pytest.approx(calibrated.auroc)
    assert sure.ece > 0.1 > calibrated.ece
    assert sure.jsd_bound < calibrated.jsd_bound
    assert sure.saturated > 0.2 > 0.02 > calibrated.saturated


def test_a_blind_one_says_a_half() -> None:
    found = health(np.zeros(40), np.zeros(30))
    assert (found.auroc, found.balanced_accuracy) == (0.5, 0.5)
    assert (found.ece, found.brier) == pytest.approx((0, 0.25), abs=1e-12)
    assert found.bce == pytest.approx(math.log(2))
    assert found.jsd_bound == pytest.approx(0)
    assert found.entropy == pytest.approx(math.log(2))


def test_equal_logits_share_a_bin_whatever_their_order() -> None:
    expert, policy = np.zeros(500), np.zeros(500)
    assert calibration(expert, policy).resolution == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("expert", [np.zeros(0), np.array([np.nan, 1.0])])
def test_nothing_to_judge_is_undefined(expert) -> None:
    assert np.isnan(health(expert, np.ones(3)).auroc)
    assert np.isnan(calibration(expert, np.ones(3)).ece)


def test_the_slope_is_the_gradient_in_standard_deviations() -> None:
    obs, action = (torch.randn(50, 2, generator=torch_stream(0, name)) for name in ("obs", "action"))
    flags = torch.zeros(50, dtype=torch.bool)
    batch = Transitions(5 * obs, action, obs, flags, flags)
    std = batch.obs.std(0, unbiased=False)
    found = steepness(lambda b: b.obs @ torch.tensor([3.0, 0.0]) + b.action[:, 1].square(), batch)
    expected = np.hypot((3 * std[0]).item(), 2 * action[:, 1].numpy())
    np.testing.assert_allclose(found, expected, rtol=1e-5)
    assert np.isnan(steepness(lambda b: b.obs[:, 0].detach(), batch)).all()
