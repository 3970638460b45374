import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from irl.rewards.maps import FAIRL_MOST, MAPS, fairl, gail, log_d, logit

logits = st.floats(-700, 1e6)


def of(logit: float) -> float:
    return float(gail(torch.tensor([logit], dtype=torch.float64)))


@given(st.floats(-30, 15))
def test_gail_is_minus_the_log_of_what_is_left_to_the_policy(logit: float) -> None:
    left = 1.0 - 1.0 / (1.0 + np.exp(-logit))
    # 1 - D is known to 1e-16, so its logarithm to 1e-16 / (1 - D)
    assert of(logit) == pytest.approx(-np.log(left), rel=1e-9, abs=1e-15 / left)


@given(st.floats(-700, 700))
def test_gail_is_the_log_of_one_plus_the_exponential(logit: float) -> None:
    # torch's softplus is the identity above 20, which is off by exp(-20)
    assert of(logit) == pytest.approx(np.logaddexp(0.0, logit), rel=1e-9)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_huge_logits_neither_overflow_nor_meet_a_cap(dtype: torch.dtype) -> None:
    logit = torch.tensor([-1e6, 19.0, 60.0, 1e6], dtype=dtype, requires_grad=True)
    reward = gail(logit)
    # -log(1 - sigmoid + 1e-8) stops at 18.4 and has no gradient there
    assert reward.tolist() == pytest.approx([0.0, 19.0, 60.0, 1e6], rel=1e-7)
    reward.sum().backward()
    assert logit.grad is not None
    assert logit.grad.tolist() == pytest.approx([0.0, 1.0, 1.0, 1.0], abs=1e-7)


@given(logits, st.floats(1e-3, 100))
def test_a_higher_logit_is_a_higher_reward(logit: float, more: float) -> None:
    assert of(logit + more) > of(logit) >= 0.0


@given(st.floats(-700, 10))
def test_it_pays_for_staying_alive_where_log_d_fines(logit: float) -> None:
    log_d = -np.logaddexp(0.0, -logit)
    assert log_d < 0 < of(logit)
    # -log(1 - D) = logit - log D
    assert of(logit) == pytest.approx(logit - log_d, abs=1e-9)


def test_a_blind_discriminator_pays_log_2() -> None:
    assert of(0.0) == pytest.approx(np.log(2), abs=1e-15)


@pytest.mark.parametrize("name", MAPS)
def test_every_map_keeps_the_shape_and_all_but_fairl_increase(name: str) -> None:
    grid = torch.linspace(-8, 8, 50, dtype=torch.float64)
    reward = MAPS[name](grid)
    assert reward.shape == grid.shape
    assert reward.dtype == torch.float64
    assert bool((reward.diff() > 0).all()) == (name != "fairl")


@given(st.floats(-30, 30))
def test_each_map_is_its_formula_of_d(h: float) -> None:
    d, left = 1 / (1 + np.exp(-h)), 1 / (1 + np.exp(h))
    found = {name: float(of(torch.tensor([h], dtype=torch.float64))) for name, of in MAPS.items()}
    # label and sign: log D is the expert's, -log(1 - D) what is left to the policy
    expected = {"gail": -np.log(left), "log_d": np.log(d), "logit": np.log(d) - np.log(left)}
    # torch's softplus is the identity above 20
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=1e-8, rel=1e-9)
    assert found["fairl"] == pytest.approx(-h * np.exp(min(h, FAIRL_MOST)), rel=1e-12)


@given(st.floats(-500, 500))
def test_the_ranges_say_who_gains_by_an_early_end(h: float) -> None:
    of_h = torch.tensor([h], dtype=torch.float64)
    assert float(gail(of_h)) > 0 or h < -36
    assert float(gail(of_h)) >= 0 >= float(log_d(of_h))
    assert float(log_d(of_h)) < 0 or h > 36
    assert float(logit(of_h)) == h
    assert float(fairl(of_h)) <= np.exp(-1) + 1e-15


def test_the_gail_reward_is_the_logit_and_the_fine_of_log_d() -> None:
    grid = torch.linspace(-40, 40, 161, dtype=torch.float64)
    torch.testing.assert_close(gail(grid) - logit(grid), -log_d(grid))
    torch.testing.assert_close(gail(-grid), -log_d(grid))


def test_fairl_peaks_where_the_policy_is_likelier_and_fines_where_the_expert_is() -> None:
    grid = torch.linspace(-5, 5, 1001, dtype=torch.float64)
    reward = fairl(grid)
    assert float(grid[reward.argmax()]) == pytest.approx(-1.0)
    assert float(reward.max()) == pytest.approx(np.exp(-1))
    assert (reward[grid > 0] < 0).all()
    assert (reward[grid < 0] > 0).all()


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_no_map_caps_or_loses_its_gradient_where_d_is_sure(name: str, dtype: torch.dtype) -> None:
    # log(1 - sigmoid + 1e-8) would stop at 18.4, and its gradient with it
    steep = {"gail": 50.0, "logit": 50.0, "log_d": -50.0, "fairl": 50.0}[name]
    h = torch.tensor([steep], dtype=dtype, requires_grad=True)
    reward = MAPS[name](h)
    reward.sum().backward()
    assert h.grad is not None
    expected = {"gail": (50, 1), "logit": (50, 1), "log_d": (-50, 1)}
    line = float(np.exp(FAIRL_MOST))
    value, slope = expected.get(name, (-50 * line, -line))
    assert reward.tolist() == pytest.approx([value], rel=1e-6)
    assert h.grad.tolist() == pytest.approx([slope], rel=1e-6)
