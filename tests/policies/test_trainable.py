import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from irl.core.nets import Normaliser, fitted_normaliser
from irl.core.types import Transitions
from irl.policies.density import Density
from irl.policies.policy import Policy, PolicySpec
from irl.policies.trainable import TrainablePolicy, fresh_policy

KINDS = ("gaussian", "squashed_gaussian", "categorical")


def made(kind: str, hidden: tuple[int, ...] = (8,), obs: int = 3, action: int = 2) -> Policy:
    rng = torch.Generator().manual_seed(1)
    spec = PolicySpec("Task-v0", obs, action, hidden, "relu", kind)
    normaliser = fitted_normaliser(torch.randn(20, obs, generator=rng))
    low = np.full(action, 0.0 if kind == "categorical" else -2.0, dtype=np.float32)
    high = np.full(action, 1.0 if kind == "categorical" else 2.0, dtype=np.float32)
    return fresh_policy(spec, normaliser, (low, high), -0.5, rng)


def batch(size: int, scale: float = 1.0, obs: int = 3, action: int = 2) -> Transitions:
    rng = torch.Generator().manual_seed(2)
    seen = scale * torch.randn(size, obs, generator=rng)
    never = torch.zeros(size, dtype=torch.bool)
    act = (4 * torch.rand(size, action, generator=rng) - 2).clamp(-2, 2)
    return Transitions(seen, act, seen, never, never)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_exported_acts_as_what_was_taken_in(kind: str) -> None:
    policy = made(kind)
    back = TrainablePolicy(policy, -20.0).export()
    assert back.weights.keys() == policy.weights.keys()
    assert all(np.array_equal(back.weights[name], policy.weights[name]) for name in policy.weights)


@pytest.mark.parametrize("kind", KINDS[:2])
def test_its_log_pi_is_that_of_the_exported_policy(kind: str) -> None:
    policy, rows = made(kind), batch(50)
    trainable = TrainablePolicy(policy, -20.0)
    torch.testing.assert_close(trainable(rows).detach(), Density(policy)(rows))


def test_a_choice_has_the_probability_that_its_logits_say() -> None:
    policy, rows = made("categorical"), batch(4)
    chosen = torch.eye(2)
    both = [
        TrainablePolicy(policy, -2.0)(
            Transitions(rows.obs, chosen[[i] * 4], rows.obs, rows.terminated, rows.truncated)
        )
        for i in range(2)
    ]
    torch.testing.assert_close(both[0].exp() + both[1].exp(), torch.ones(4))


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(size=st.integers(1, 4), power=st.integers(-8, 20))
def test_gradients_are_finite_for_any_batch_and_any_size_of_observation(
    kind: str, size: int, power: int
) -> None:
    net = TrainablePolicy(made(kind), -2.0)
    net(batch(size, 10.0**power)).sum().backward()
    assert all(torch.isfinite(p.grad).all() for p in net.parameters() if p.grad is not None)


def test_a_deviation_below_the_least_is_pulled_no_further_and_exported_as_the_least() -> None:
    net = TrainablePolicy(made("gaussian"), 0.0)
    net(batch(10)).sum().backward()
    log_std = dict(net.named_parameters())["log_std"]
    assert log_std.grad is not None
    assert bool((log_std.grad == 0).all())
    assert np.array_equal(net.export().weights["log_std"], np.zeros(2, dtype=np.float32))


def test_an_unusual_bound_of_observations_is_kept() -> None:
    spec = PolicySpec("Task-v0", 2, 1, (4,), "tanh", "gaussian")
    box = np.full(1, -1.0, dtype=np.float32), np.full(1, 1.0, dtype=np.float32)
    policy = fresh_policy(spec, Normaliser(2, 3.0), box, 0.0, torch.Generator().manual_seed(0))
    far, at_bound = np.array([99.0, -99.0]), np.array([3.0, -3.0])
    assert np.array_equal(policy(far), policy(at_bound))
