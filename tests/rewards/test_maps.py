import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from irl.rewards.maps import MAPS, gail

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
def test_every_map_increases_and_keeps_the_shape(name: str) -> None:
    grid = torch.linspace(-8, 8, 50, dtype=torch.float64)
    reward = MAPS[name](grid)
    assert reward.shape == grid.shape
    assert reward.dtype == torch.float64
    assert (reward.diff() > 0).all()
