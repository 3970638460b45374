"""The gradient steps are SB3's: the same weights from the same rollouts, order and settings."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from irl.core.types import Transitions
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.ppo_rollout import give_rewards
from tests import pointmass  # noqa: F401  registers the tasks

SMALL = PPOConfig(
    n_envs=2, steps_per_round=128, batch_size=32, n_epochs=13, lr=1e-3, hidden=(16, 8), gamma=0.9
)
"""13 passes of 4 steps: 52."""


def position(batch: Transitions) -> Tensor:
    return -batch.next_obs.norm(dim=1)


def learner(**changes: Any) -> PPOLearner:
    ours = PPOLearner("PointMass-v0", [0, 1], replace(SMALL, **changes), seed=0, total_steps=1280)
    # away from the first weights, so that ratios are clipped and values are wrong
    give_rewards(ours.model, ours._scale, ours.collect(), position)
    return ours


def trained(by_sb3: bool, **changes: Any) -> tuple[dict[str, Tensor], dict[str, float]]:
    ours = learner(**changes)
    np.random.seed(3)  # noqa: NPY002
    if not by_sb3:
        metrics = ours._train()
        return ours.model.policy.state_dict(), metrics
    ours.model._update_current_progress_remaining(ours.env_steps, ours.total_steps)
    ours.model.train()
    logged = ours.model.logger.name_to_value
    names = ("approx_kl", "clip_fraction", "value_loss", "explained_variance", "std")
    return ours.model.policy.state_dict(), {f"ppo/{name}": float(logged[f"train/{name}"]) for name in names}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"activation": "relu", "ent_coef": 0.01, "lr_schedule": "constant"},
        {"clip_range_vf": 0.05, "vf_coef": 0.2, "max_grad_norm": 0.05},
        {"normalize_advantage": False, "clip_range": 0.02},
        {"target_kl": 0.003},
    ],
)
def test_fifty_steps_give_the_weights_and_the_figures_of_sb3(changes: dict[str, Any]) -> None:
    (mine, my_figures), (its, its_figures) = trained(False, **changes), trained(True, **changes)
    start = learner(**changes).model.policy.state_dict()
    for name, weight in its.items():
        torch.testing.assert_close(mine[name], weight, rtol=1e-3, atol=2e-5)
    assert max(float((its[name] - start[name]).abs().max()) for name in its) > 1e-3
    for name, value in its_figures.items():
        assert my_figures[name] == pytest.approx(value, rel=1e-2, abs=1e-5), name


def test_a_target_of_kl_stops_the_passes() -> None:
    """Of the case above: fewer steps were taken than without it."""
    stopped, free = learner(target_kl=0.003), learner()
    for ours in (stopped, free):
        ours._train()
    assert stopped.model._n_updates < free.model._n_updates == SMALL.n_epochs


def test_the_networks_that_act_are_the_ones_that_were_trained() -> None:
    ours = learner()
    obs = np.random.default_rng(0).normal(size=(5, 2))
    before = ours.model.predict(obs, deterministic=True)[0]
    ours._train()
    assert not np.array_equal(ours.model.predict(obs, deterministic=True)[0], before)
