import numpy as np
import pytest
import torch
import torch.nn.functional as F
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from irl.discriminators.losses import bce, entropy_bonus

some_logits = arrays(np.float64, st.integers(1, 8), elements=st.floats(-30, 30)).map(torch.from_numpy)


def test_a_blind_discriminator_loses_log_4() -> None:
    zeros = torch.zeros(5, dtype=torch.float64)
    assert float(bce(zeros, zeros)) == pytest.approx(np.log(4), abs=1e-15)


def test_a_perfect_one_loses_nothing_and_a_wrong_one_its_logits() -> None:
    sure = torch.full((5,), 800.0)
    assert float(bce(sure, -sure)) == 0.0
    assert float(bce(-sure, sure)) == 1600.0


@given(some_logits, some_logits)
def test_it_is_binary_cross_entropy_with_the_expert_as_1(expert: torch.Tensor, policy: torch.Tensor) -> None:
    of_class = F.binary_cross_entropy_with_logits
    expected = of_class(expert, torch.ones_like(expert)) + of_class(policy, torch.zeros_like(policy))
    assert float(bce(expert, policy)) == pytest.approx(float(expected), rel=1e-8)


@given(some_logits, some_logits)
def test_exchanging_the_classes_flips_the_sign(expert: torch.Tensor, policy: torch.Tensor) -> None:
    assert float(bce(expert, policy)) == pytest.approx(float(bce(-policy, -expert)), rel=1e-12)


def test_its_gradient_raises_the_experts_logits_and_lowers_the_policys() -> None:
    expert, policy = (torch.tensor([-2.0, 0.0, 3.0], requires_grad=True) for _ in range(2))
    bce(expert, policy).backward()
    assert expert.grad is not None
    assert policy.grad is not None
    # d/dlogit of the mean: (D - 1) / n for the expert, D / n for the policy
    torch.testing.assert_close(expert.grad, (torch.sigmoid(expert.detach()) - 1) / 3)
    torch.testing.assert_close(policy.grad, torch.sigmoid(policy.detach()) / 3)


@given(st.lists(st.tuples(st.floats(-30, 30), st.integers(1, 4)), min_size=1, max_size=6))
def test_a_row_of_weight_w_counts_as_w_rows(rows: list[tuple[float, int]]) -> None:
    logits = torch.tensor([h for h, _ in rows], dtype=torch.float64)
    weight = torch.tensor([float(w) for _, w in rows], dtype=torch.float64)
    repeated = torch.tensor([h for h, w in rows for _ in range(w)], dtype=torch.float64)
    other = torch.tensor([0.5, -2.0], dtype=torch.float64)
    assert float(bce(logits, other, weight)) == pytest.approx(float(bce(repeated, other)), rel=1e-12)
    assert float(bce(other, logits, None, weight)) == pytest.approx(float(bce(other, repeated)), rel=1e-12)


def test_equal_weights_are_none_and_a_weight_of_0_leaves_a_row_out() -> None:
    expert, policy = torch.tensor([1.0, -3.0, 9.0]), torch.tensor([0.3, 4.0])
    assert float(bce(expert, policy, torch.full((3,), 0.05))) == pytest.approx(float(bce(expert, policy)))
    without = bce(expert, policy, torch.tensor([1.0, 1.0, 0.0]))
    assert float(without) == pytest.approx(float(bce(expert[:2], policy)))


@given(some_logits)
def test_the_entropy_is_that_of_a_coin_of_d(logits: torch.Tensor) -> None:
    d, left = torch.sigmoid(logits), torch.sigmoid(-logits)
    expected = -(d * d.log() + left * left.log()).mean()
    # torch's softplus is the identity above 20, which is off by exp(-20)
    assert float(entropy_bonus(logits)) == pytest.approx(float(expected), abs=1e-8)


def test_a_blind_coin_has_log_2_and_a_sure_one_nothing() -> None:
    zeros = torch.zeros(3, dtype=torch.float64)
    assert float(entropy_bonus(zeros)) == pytest.approx(np.log(2))
    for sure in (800.0, -800.0):
        assert float(entropy_bonus(zeros + sure)) == pytest.approx(0.0, abs=1e-12)
