import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from irl.algorithms.bc import BC, Cloning, CloningConfig, acted, mean_log_pi
from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.envs.absorbing import absorb
from irl.policies.policy import PolicySpec
from irl.policies.trainable import TrainablePolicy, fresh_policy

BOX = np.full(1, -9.0, dtype=np.float32), np.full(1, 9.0, dtype=np.float32)


def linear(hidden: tuple[int, ...] = (), kind: str = "gaussian"):
    spec = PolicySpec("Task-v0", 2, 1, hidden, "relu", kind)
    return fresh_policy(spec, Normaliser(2), BOX, 0.0, torch.Generator().manual_seed(0))


def demonstrations(size: int = 400, noise: float = 0.3, scale: float = 1.0) -> Transitions:
    """a = 2 s_0 - s_1 + 0.5 + noise."""
    rng = torch.Generator().manual_seed(3)
    obs = scale * torch.randn(size, 2, generator=rng)
    mean = 2 * obs[:, :1] - obs[:, 1:] + 0.5
    action = (mean + noise * torch.randn(size, 1, generator=rng)).clamp(-8, 8)
    never = torch.zeros(size, dtype=torch.bool)
    return Transitions(obs, action, obs, never, never)


def test_of_a_linear_gaussian_policy_it_is_least_squares_and_the_residuals_deviation() -> None:
    expert = demonstrations()
    cloning = Cloning(linear(), expert, CloningConfig(batch_size=400), torch.Generator().manual_seed(0))
    for rate in (0.05, 0.005):
        cloning.optimizer.param_groups[0]["lr"] = rate
        for _ in range(100):
            cloning.update()
    found = cloning.net.export().weights
    x = torch.cat([expert.obs, torch.ones(len(expert), 1)], 1).numpy()
    solution, residual, *_ = np.linalg.lstsq(x, expert.action.numpy(), rcond=None)
    assert found["layers.0.weight"][0] == pytest.approx(solution[:2, 0], abs=0.02)
    assert found["layers.0.bias"] == pytest.approx(solution[2], abs=0.02)
    assert found["log_std"][0] == pytest.approx(math.log(np.sqrt(residual[0] / len(expert))), abs=0.05)


def test_the_weight_of_a_row_counts_as_rows() -> None:
    rows = demonstrations(4)
    weighted = Transitions(
        rows.obs,
        rows.action,
        rows.obs,
        rows.terminated,
        rows.truncated,
        weight=torch.tensor([1.0, 0.0, 3.0, 0.0]),
    )
    net = TrainablePolicy(linear(), -2.0)
    repeated = net(rows[torch.tensor([0, 2, 2, 2])]).mean()
    torch.testing.assert_close(mean_log_pi(net, weighted), repeated)


def test_steps_in_the_absorbing_state_are_left_out() -> None:
    rows = demonstrations(3)
    ended = Transitions(rows.obs, rows.action, rows.obs, torch.tensor([False, False, True]), rows.truncated)
    assert len(absorb(ended)) == 4
    assert torch.equal(acted(absorb(ended)).action, rows.action)


def test_it_goes_on_to_the_same_weights_from_its_state() -> None:
    def begun() -> BC:
        fit = Cloning(linear((8,)), demonstrations(), CloningConfig(), torch.Generator().manual_seed(0))
        return BC(fit, demonstrations(50), per_round=10)

    straight, stopped, resumed = begun(), begun(), begun()
    rounds = list(straight.rounds(40))
    assert [r.env_steps for r in rounds] == [10, 20, 30, 40]
    assert {"bc/log_pi", "bc/log_pi_held_out"} == set(rounds[0].metrics)
    list(stopped.rounds(20))
    resumed.load_state_dict(stopped.state_dict())
    assert [r.index for r in resumed.rounds(40)] == [3, 4]
    ends = [algorithm.policy().weights for algorithm in (straight, resumed)]
    assert all(np.array_equal(ends[0][name], ends[1][name]) for name in ends[0])


@pytest.mark.parametrize("kind", ["gaussian", "squashed_gaussian"])
@settings(max_examples=15)
@given(size=st.integers(1, 3), power=st.integers(-6, 12))
def test_one_transition_and_any_size_of_observation_give_finite_weights(
    kind: str, size: int, power: int
) -> None:
    expert = demonstrations(size, scale=10.0**power)
    fit = Cloning(linear((4,), kind), expert, CloningConfig(batch_size=2), torch.Generator().manual_seed(0))
    for _ in range(5):
        assert torch.isfinite(fit.update())
    assert all(np.isfinite(value).all() for value in fit.net.export().weights.values())


def test_settings_below_their_least_are_named() -> None:
    with pytest.raises(ValueError, match="batch_size must be at least 1, not 0"):
        CloningConfig(batch_size=0)
