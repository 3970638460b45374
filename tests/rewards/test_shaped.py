"""f = g + gamma h(s') - h(s): what is left of h over an episode, however the episode ends."""

from dataclasses import replace
from typing import Literal

import pytest
import torch
from torch import Tensor

from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.envs.absorbing import absorb
from irl.rewards.shaped import ShapedNet, ShapedSpec, shaped

GAMMA, STEPS = 0.9, 12


def episode(end: str, seed: int = 0) -> Transitions:
    """Twelve steps in order, of which the last one ends it."""
    rng = torch_stream(seed, "episode")
    obs, action = 3.0 + 2.0 * torch.randn(STEPS + 1, 3, generator=rng), torch.rand(STEPS, 2, generator=rng)
    last = torch.arange(STEPS) == STEPS - 1
    never = torch.zeros_like(last)
    terminated, truncated = (last, never) if end == "terminated" else (never, last)
    return Transitions(obs[:-1], action, obs[1:], terminated, truncated)


def net(scale: float = 0.0, inputs: Literal["obs", "obs_action"] = "obs_action") -> ShapedNet:
    spec = ShapedSpec(3, 2, (8,), (7,), inputs=inputs, absorbing_scale=scale)
    return ShapedNet(
        spec, fitted_normaliser(episode("truncated").obs), torch_stream(1, "net")
    ).requires_grad_(False)


def discounted(values: Tensor) -> float:
    return float((values.double() * GAMMA ** torch.arange(len(values))).sum())


def potential(of: ShapedNet, obs: Tensor) -> float:
    flags = torch.zeros(1, dtype=torch.bool)
    at = Transitions(obs[None], torch.zeros(1, 2), obs[None], flags, flags)
    return float(of.h(at))


@pytest.mark.parametrize("scale", [0.0, 10.0], ids=["mask", "absorbing"])
@pytest.mark.parametrize("end", ["terminated", "truncated"])
def test_shaping_telescopes_over_an_episode(end: str, scale: float) -> None:
    """Sums of f and g differ by -h(s_0), and by gamma^T h(s_T) where a value goes on from there."""
    of, steps = net(scale), episode(end)
    left = discounted(of.paid("f", steps, GAMMA)) - discounted(of.paid("g", steps, GAMMA))
    expected = -potential(of, steps.obs[0])
    if end == "truncated":
        expected += GAMMA**STEPS * potential(of, steps.next_obs[-1])
    assert left == pytest.approx(expected, abs=1e-4)


def test_an_end_led_into_the_absorbing_state_leaves_its_potential_until_then() -> None:
    """As SAC has it in its memory: the same episode going on in s_abs for ever telescopes to -h(s_0)."""
    of, steps = net(10.0), absorb(episode("terminated"))
    going_on = torch.cat([of.f(steps, GAMMA)[:STEPS], of.f(steps, GAMMA)[STEPS:].expand(400)])
    by_itself = torch.cat([of.g(steps)[:STEPS], of.g(steps)[STEPS:].expand(400)])
    left = discounted(going_on) - discounted(by_itself)
    assert left == pytest.approx(-potential(of, steps.obs[0]), abs=1e-4)


@pytest.mark.parametrize("part", ["g", "f"])
def test_a_recorded_end_is_paid_what_its_absorbing_rows_sum_to(part: str) -> None:
    of, recorded = net(10.0), episode("terminated")
    rows = of.paid(part, absorb(recorded), GAMMA)
    by_rows = discounted(torch.cat([rows[:STEPS], rows[STEPS:].expand(400)]))
    assert discounted(of.paid(part, recorded, GAMMA)) == pytest.approx(by_rows, abs=1e-4)


def test_h_is_left_out_at_a_termination_and_nowhere_else() -> None:
    of, steps = net(), episode("terminated")
    other = replace(steps, terminated=~steps.terminated)
    h_next = torch.tensor([potential(of, row) for row in steps.next_obs])
    difference = of.f(steps, GAMMA) - of.f(other, GAMMA)
    signs = torch.where(steps.terminated, -1.0, 1.0)
    torch.testing.assert_close(difference, signs * GAMMA * h_next, atol=1e-5, rtol=1e-4)


def test_it_is_the_equation_row_by_row() -> None:
    g, now, after = (torch.randn(5, generator=torch_stream(0, name)) for name in ("g", "now", "after"))
    kept = torch.tensor([1.0, 0.0, 1.0, 1.0, 0.0])
    expected = [float(g[i]) + 0.97 * float(kept[i]) * float(after[i]) - float(now[i]) for i in range(len(g))]
    torch.testing.assert_close(shaped(g, now, after, kept, 0.97), torch.tensor(expected))


def test_a_state_only_g_sees_no_action_and_neither_does_f() -> None:
    of, steps = net(inputs="obs"), episode("truncated")
    pushed = replace(steps, action=steps.action + 5.0)
    assert torch.equal(of.f(steps, GAMMA), of.f(pushed, GAMMA))
    assert not torch.equal(net().f(steps, GAMMA), net().f(pushed, GAMMA))


def test_the_absorbing_state_is_its_flag_alone_and_needs_a_network_that_knows_it() -> None:
    of = net(10.0)
    absorbed = absorb(episode("terminated"))
    assert float(of.g(absorbed)[-1]) == pytest.approx(float(of.of_absorbing()), abs=1e-6)
    x = of.inputs(absorbed)
    assert x.step[-1].tolist() == [0.0, 0.0, 0.0, 10.0, 0.0, 0.0]
    assert x.after[STEPS - 1].tolist() == [0.0, 0.0, 0.0, 10.0]
    with pytest.raises(ValueError, match="do not know"):
        net().f(absorbed, GAMMA)
    with pytest.raises(ValueError, match="no absorbing state"):
        net().of_absorbing()


def test_a_part_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown part 'advantage'; known: g, f"):
        net().paid("advantage", episode("truncated"), GAMMA)
