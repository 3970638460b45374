"""Batches of any shape and size: one row, one step of one episode, observations huge and tiny."""

from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from irl.core.nets import fitted_normaliser
from irl.core.types import Episode, Transitions, from_episodes
from irl.discriminators import losses
from irl.discriminators.airl import AIRL, AIRLConfig
from irl.discriminators.dac import DAC, DACConfig
from irl.discriminators.gail import GAIL, GAILConfig
from irl.envs.absorbing import absorb

METHODS = {"gail": (GAIL, GAILConfig), "dac": (DAC, DACConfig), "airl": (AIRL, AIRLConfig)}
SHAPES = st.fixed_dictionaries(
    {
        "obs": st.integers(1, 4),
        "action": st.integers(1, 3),
        "expert": st.lists(st.integers(1, 4), min_size=1, max_size=3),
        "policy": st.lists(st.integers(1, 4), min_size=1, max_size=3),
        "hidden": st.sampled_from([(), (5,), (5, 3)]),
    }
)
# From 1e19 on a variance is no float32; runs stop there, because the normaliser is not finite.
SCALES = st.sampled_from([0.0, 1e-30, 1e-8, 1.0, 1e8, 1e15])


def episode(steps: int, shape: dict[str, Any], scale: float, rng: np.random.Generator) -> Episode:
    obs = scale * rng.standard_normal((steps + 1, shape["obs"]))
    action = rng.uniform(-1.0, 1.0, (steps, shape["action"]))
    ended = bool(rng.random() < 0.5)
    return Episode(obs, action, np.zeros(steps), ended, not ended)


def batch(lengths: list[int], shape: dict[str, Any], scale: float, seed: int) -> Transitions:
    rng = np.random.default_rng(seed)
    return from_episodes([episode(n, shape, scale, rng) for n in lengths])


def made(method: str, shape: dict[str, Any], expert: Transitions) -> GAIL | AIRL:
    of, config = METHODS[method]
    more: dict[str, Any] = {"log_pi": lambda b: -b.action.square().sum(1)} if method == "airl" else {}
    return of(
        shape["obs"],
        shape["action"],
        config(hidden=shape["hidden"]),
        normaliser=fitted_normaliser(expert.obs),
        init_rng=torch.Generator().manual_seed(0),
        rng=torch.Generator().manual_seed(1),
        gamma=0.9,
        **more,
    )


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=8)
@given(shape=SHAPES, expert_scale=SCALES, policy_scale=SCALES, seed=st.integers(0, 99))
def test_updates_and_rewards_are_finite_and_one_a_row(
    method: str, shape: dict[str, Any], expert_scale: float, policy_scale: float, seed: int
) -> None:
    expert = batch(shape["expert"], shape, expert_scale, seed)
    policy = batch(shape["policy"], shape, policy_scale, seed + 1)
    one = made(method, shape, expert)
    pairs = [(expert, policy)] if method == "gail" else [(expert, policy), (absorb(expert), absorb(policy))]
    for pair in pairs * 2:
        # as the loops draw them: as many of each
        of_expert, of_policy = (rows[: min(map(len, pair))] for rows in pair)
        said = one.update(of_expert, of_policy)
        assert np.isfinite(list(said.values())).all(), said
        for rows in (of_expert, of_policy):
            reward = one.reward(rows)
            assert reward.shape == (len(rows),)
            assert torch.isfinite(reward).all()
    assert all(torch.isfinite(value).all() for value in one.net.state_dict().values())


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=8)
@given(shape=SHAPES, scale=SCALES, seed=st.integers(0, 99))
def test_a_row_is_judged_by_itself(method: str, shape: dict[str, Any], scale: float, seed: int) -> None:
    """In whatever batch and order; so a reward can be asked of one step."""
    rows = batch(shape["policy"], shape, scale, seed)
    one = made(method, shape, batch(shape["expert"], shape, 1.0, seed + 1))
    together = one.reward(rows)
    torch.testing.assert_close(one.reward(rows[torch.arange(len(rows)).flip(0)]), together.flip(0))
    for i in range(len(rows)):
        torch.testing.assert_close(one.reward(rows[torch.tensor([i])]), together[i : i + 1])


LOSSES: dict[str, Any] = {
    "bce": losses.bce,
    "smoothed": lambda e, p, *w: losses.smoothed(e, p, 0.2, *w),
    "positive unlabelled": lambda e, p, *w: losses.positive_unlabelled(e, p, 0.3, *w),
    "wasserstein": losses.wasserstein,
    "mixed": lambda e, p, *w: losses.mixed(e, torch.linspace(0.0, 1.0, len(e)), *w[:1]),
    "entropy": lambda e, p, *w: losses.entropy_bonus(e),
}
LOGITS = st.lists(st.floats(-(2.0**99), 2.0**99, width=32), min_size=1, max_size=5)


@pytest.mark.parametrize("name", LOSSES)
@settings(max_examples=25)
@given(expert=LOGITS, policy=LOGITS, weighted=st.booleans())
def test_losses_and_their_gradients_are_finite_whatever_the_logits(
    name: str, expert: list[float], policy: list[float], weighted: bool
) -> None:
    rows: list[Tensor] = [torch.tensor(logits, requires_grad=True) for logits in (expert, policy)]
    weights = [torch.linspace(1.0, 2.0, len(r)) for r in rows] if weighted else []
    loss = LOSSES[name](*rows, *weights)
    loss.backward()
    assert loss.shape == ()
    assert torch.isfinite(loss)
    assert all(torch.isfinite(r.grad).all() for r in rows if r.grad is not None)
