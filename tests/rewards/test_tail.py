"""What the absorbing state pays after a termination, against the sum it stands for."""

from dataclasses import replace

import pytest
import torch

from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.envs.absorbing import absorb
from irl.rewards import tail
from irl.rewards.maps import MAPS
from irl.rewards.nets import LogitNet, LogitSpec


def steps(n: int = 12) -> Transitions:
    rng = torch_stream(0, "steps")
    obs, action, after = (3 + torch.randn(n, d, generator=rng) for d in (3, 2, 3))
    flags = torch.zeros(n, dtype=torch.bool)
    return Transitions(obs, action, after, flags, flags)


def net(scale: float = 10.0) -> LogitNet:
    spec = LogitSpec(3, 2, (6,), absorbing_scale=scale)
    return LogitNet(spec, fitted_normaliser(steps().obs), torch_stream(0, "net")).requires_grad_(False)


def test_a_termination_is_worth_the_discounted_sum_of_all_that_follows() -> None:
    logit, gamma = net(), 0.9
    ended = replace(steps(), terminated=torch.arange(12) == 11)
    of_abs = float(logit.of_absorbing())
    # slow oracle: the discounted return of the episode, 500 steps into s_abs
    with torch.no_grad():
        rewards = [*logit(steps()).tolist(), *([of_abs] * 500)]
    expected = sum(gamma**t * reward for t, reward in enumerate(rewards))
    found = sum(gamma**t * r for t, r in enumerate(tail.reward(logit, "logit", ended, gamma).tolist()))
    assert found == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("reward_map", MAPS)
def test_only_terminated_steps_get_it_and_through_the_map(reward_map: str) -> None:
    logit, ends = net(), torch.arange(12) % 5 == 4
    ended = replace(steps(), terminated=ends)
    added = tail.reward(logit, reward_map, ended, 0.75) - MAPS[reward_map](logit(steps()))
    torch.testing.assert_close(added[ends], 3 * MAPS[reward_map](logit.of_absorbing()).expand(2))
    assert (added[~ends] == 0).all()


def test_a_time_limit_is_no_termination() -> None:
    logit = net()
    cut = replace(steps(), truncated=torch.ones(12, dtype=torch.bool))
    assert torch.equal(tail.reward(logit, "logit", cut, 0.9), logit(steps()))
    # nor beside one that is
    fell = torch.arange(12) == 5
    both = tail.reward(logit, "logit", replace(cut, truncated=~fell, terminated=fell), 0.9)
    assert torch.equal(both[~fell], logit(steps())[~fell])
    assert not torch.equal(both[fell], logit(steps())[fell])


def test_absorbed_steps_are_not_paid_twice() -> None:
    logit = net()
    absorbed = absorb(replace(steps(), terminated=torch.arange(12) == 11))
    assert torch.equal(tail.reward(logit, "logit", absorbed, 0.9), logit(absorbed))


def test_a_network_without_the_state_adds_nothing() -> None:
    logit, everywhere = net(0.0), torch.ones(12, dtype=torch.bool)
    ended = replace(steps(), terminated=everywhere)
    assert torch.equal(tail.reward(logit, "gail", ended, 1.0), MAPS["gail"](logit(steps())))


@pytest.mark.parametrize("gamma", [1.0, -0.1, 1.5])
def test_for_ever_has_no_sum_without_a_discount(gamma: float) -> None:
    assert tail.reward(net(), "logit", steps(), gamma).shape == (12,)
    ended = replace(steps(), terminated=torch.arange(12) == 11)
    with pytest.raises(ValueError, match=r"gamma must be in \[0, 1\)"):
        tail.reward(net(), "logit", ended, gamma)
