"""Curves whose peak is known, and curves that have none."""

import math

import numpy as np
import pytest

from irl.diagnostics.overoptimisation import aicc, decoupling, fitted, monotone, overoptimisation

STEPS = np.array([0, 1, 2, 4, 6, 8, 12, 16, 24, 32, 48, 64]) * 1000
D = np.sqrt(STEPS / STEPS[-1])


def gao(alpha: float = 50.0, beta: float = 150.0) -> np.ndarray:
    """Peaks at d = exp(1/3 - 1) = .51."""
    y = np.zeros(len(D))
    y[1:] = D[1:] * (alpha - beta * np.log(D[1:]))
    return y


def test_the_planted_peak_is_found_and_the_gap_opens() -> None:
    rng = np.random.default_rng(0)
    gold = 100.0 + gao() + rng.normal(0.0, 0.5, len(D))
    found = overoptimisation(STEPS, 10.0 * D, gold)
    assert found.fit is not None
    assert (found.fit.alpha, found.fit.beta) == pytest.approx((50.0, 150.0), rel=0.05)
    assert found.fit.peak == pytest.approx(math.exp(50 / 150 - 1), rel=0.02)
    assert found.fit_reason is None
    assert STEPS[found.peak] == 16000
    assert found.drop == pytest.approx((gold[7] - gold[-1]) / (gold[7] - gold[0]))
    assert found.drop > 0.2
    assert found.proxy_rose
    assert found.gap > 1.0
    assert found.decoupling is not None
    assert 3 <= found.decoupling <= 7


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("curve", [D, D**0.4, 1.0 - np.exp(-D / 0.2), -D])
def test_a_monotone_curve_is_not_fitted(curve: np.ndarray, seed: int) -> None:
    gold = 100.0 * curve + np.random.default_rng(seed).normal(0.0, 2.0, len(D))
    fit, reason = fitted(STEPS, gold)
    assert fit is None
    assert reason is not None


def test_a_peak_of_noise_is_not_fitted() -> None:
    # rises, then stands: by chance the best fit has its peak inside, as every third such curve's does
    rng, refused = np.random.default_rng(0), 0
    for _ in range(60):
        gold = 100.0 * (1.0 - np.exp(-D / 0.2)) + rng.normal(0.0, 3.0, len(D))
        fit, reason = fitted(STEPS, gold)
        assert fit is None or fit.gain > 2.0
        refused += "AICc" in (reason or "")
    assert refused > 0


def test_nor_is_a_short_one_or_one_that_stands_still() -> None:
    fit, reason = fitted(STEPS[:8], gao()[:8])
    assert fit is None
    assert "7 points after the first" in (reason or "")
    assert fitted(STEPS, np.ones(len(STEPS))) == (None, "the gold return stands still")


def test_what_moves_by_less_than_its_errors_stands_still() -> None:
    gold = np.array([0.0, 50.0, 100.0, 99.0, 100.5, 98.0, 100.0, 97.0])
    proxy, error = np.arange(8.0), np.full(8, 5.0)
    steps = np.arange(8)
    assert overoptimisation(steps, proxy, gold).drop == pytest.approx(3.5 / 100.5)
    assert decoupling(proxy[2:], gold[2:], error[2:] * 0) is not None
    found = overoptimisation(steps, proxy, gold, error)
    assert found.drop == 0.0
    assert found.decoupling is None
    # a long climb before: the plateau is a small part of it
    climbed = np.concatenate([np.linspace(-3000.0, -50.0, 6), gold])
    assert decoupling(np.arange(14.0), climbed, np.zeros(14)) is None
    lucky = overoptimisation(steps, proxy, np.array([95.0, *gold[1:-1], 80.0]), error * 0, floor=0.0)
    assert lucky.drop == pytest.approx(20.5 / 5.5)
    assert lucky.lost == pytest.approx(20.5 / 100.5)
    never = overoptimisation(steps, proxy, -gold, error)
    assert math.isnan(never.drop)


def test_a_proxy_that_follows_gold_never_decouples() -> None:
    assert decoupling(gao(), gao(), np.zeros(len(D))) is None
    assert overoptimisation(STEPS, gao(), gao()).gap == pytest.approx(0.0)
    assert overoptimisation(STEPS, gao(), gao()).proxy_rose is False


def test_a_proxy_that_moved_within_its_errors_neither_rose_nor_fell() -> None:
    proxy = np.where(STEPS[-1] == STEPS, 10.2, 10.0)
    for error, rose in ((0.0, True), (0.05, True), (0.1, None)):
        errors = np.full(len(D), error)
        assert overoptimisation(STEPS, proxy, gao(), proxy_error=errors).proxy_rose is rose


def test_aicc_is_its_formula_and_monotone_curves_fit_themselves() -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(size=10)
    k = 3
    expected = 10 * math.log(float(noise @ noise) / 10) + 2 * k + 2 * k * (k + 1) / (10 - k - 1)
    assert aicc(noise, 2) == pytest.approx(expected)
    d = D[1:]
    line, power, bent = monotone(d, 3.0 * d**0.5)
    assert power < min(line, bent) - 10
    line, power, bent = monotone(d, 3.0 * (1 - np.exp(-d / 0.3)))
    assert bent < min(line, power) - 10


def test_what_it_cannot_do_is_said() -> None:
    for n, value in ((1, 0.0), (3, math.nan)):
        with pytest.raises(ValueError, match="two or more finite"):
            overoptimisation(np.arange(n), np.zeros(n), np.full(n, value))
