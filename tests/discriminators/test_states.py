"""Discriminators of states and of pairs of states."""

import pytest
import torch

from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.discriminators.gail import GAIL, GAILConfig
from irl.envs.absorbing import absorb
from irl.rewards.nets import LogitNet, LogitSpec


def steps(n: int, actions: int, shift: float = 0.0, moved: float = 0.0) -> Transitions:
    g = torch.Generator().manual_seed(0)
    obs = torch.randn(n, 2, generator=g) + shift
    never = torch.zeros(n, dtype=torch.bool)
    return Transitions(obs, torch.zeros(n, actions), obs + moved, never, never)


def gail(inputs: str) -> GAIL:
    rng = torch.Generator().manual_seed(1)
    config = GAILConfig(hidden=(16,), inputs=inputs, gradient_penalty=0.1, lr=1e-2)  # pyright: ignore[reportArgumentType]
    return GAIL(2, 3, config, normaliser=Normaliser(2), init_rng=rng, rng=rng)


@pytest.mark.parametrize(("inputs", "expert"), [("obs", {"shift": 2.0}), ("obs_next_obs", {"moved": 2.0})])
def test_demonstrations_without_actions_are_told_apart(inputs, expert) -> None:
    shown, policy = steps(256, 0, **expert), steps(256, 3)
    discriminator = gail(inputs)
    for _ in range(200):
        discriminator.update(shown, policy)
    assert (discriminator.logits(shown) > 0).double().mean() > 0.8
    assert (discriminator.logits(policy) < 0).double().mean() > 0.8


def test_pairs_that_states_do_not_tell_apart() -> None:
    shown, policy = steps(256, 0, moved=2.0), steps(256, 3)
    discriminator = gail("obs")
    for _ in range(200):
        discriminator.update(shown, policy)
    torch.testing.assert_close(discriminator.logits(shown), discriminator.logits(policy))


@pytest.mark.parametrize(("sees", "inputs"), [("obs_action", 6), ("obs", 3), ("obs_next_obs", 6)])
def test_what_is_seen_of_the_absorbing_state(sees, inputs) -> None:
    spec = LogitSpec(2, 3, (4,), absorbing_scale=10.0, sees=sees)
    net = LogitNet(spec, Normaliser(2), torch.Generator().manual_seed(0))
    batch = steps(3, 3)
    ended = torch.tensor([False, True, False])
    batch = absorb(Transitions(batch.obs, batch.action, batch.next_obs, ended, ~ended & ended))
    x = net.inputs(batch)
    assert x.shape == (4, inputs)
    assert spec.inputs == inputs
    torch.testing.assert_close(net(batch)[3:], net.of_absorbing())
    if sees == "obs_next_obs":
        # the step before the end is (s_T, s_abs)
        assert x[1].tolist() == [*batch.obs[1].tolist(), 0.0, 0.0, 0.0, 10.0]
        recorded = net.inputs(
            Transitions(batch.obs[:3], batch.action[:3], batch.obs[:3], ended, ~ended & ended)
        )
        torch.testing.assert_close(recorded[1], x[1])


def test_what_is_seen_is_one_of_three() -> None:
    with pytest.raises(ValueError, match="sees must be one of obs_action, obs, obs_next_obs"):
        LogitSpec(2, 1, sees="action")
