"""A learner that took in a policy acts as it, and goes on learning."""

from typing import Any

import numpy as np
import pytest
import torch

from irl.core.types import from_episodes
from irl.envs.rollouts import rollouts
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.policies.trainable import TrainablePolicy
from tests import pointmass

TASK = "PointMass-v0"


def learners() -> list[PPOLearner | SACLearner]:
    run: dict[str, Any] = {"seed": 0, "total_steps": 100}
    ppo = PPOConfig(n_envs=1, steps_per_round=32, batch_size=32, n_epochs=1, hidden=(8,))
    sac = SACConfig(steps_per_round=8, learning_starts=4, batch_size=4, hidden=(8,), average=0.5)
    return [
        PPOLearner(TASK, [0], ppo, **run),
        SACLearner(TASK, [0], sac, **run),
        SACLearner(TASK, [0], sac, absorbing_scale=10.0, **run),
    ]


@pytest.mark.parametrize("which", range(3))
def test_it_acts_as_the_policy_and_log_pi_is_the_policys(which: int) -> None:
    learner = learners()[which]
    net = TrainablePolicy(learner.policy(), -2.0)
    with torch.no_grad():
        for p in net.parameters():
            p += 0.1 * torch.randn(p.shape, generator=torch.Generator().manual_seed(0))
    learner.adopt(policy := net.export())
    after = learner.policy().weights
    assert all(np.array_equal(after[name], policy.weights[name]) for name in policy.weights)
    # the one that acts and is trained, which is not the average that is exported
    obs = np.random.default_rng(0).normal(size=(5, 2)).astype(np.float32)
    seen = np.column_stack([obs, np.zeros(5, np.float32)]) if which == 2 else obs
    acted, _ = learner.model.predict(seen, deterministic=True)
    np.testing.assert_allclose(acted, [policy(o) for o in obs], atol=1e-5)
    batch = from_episodes(rollouts(TASK, policy, [3]))
    torch.testing.assert_close(learner.log_pi(batch), net(batch).detach(), atol=1e-4, rtol=1e-4)
    learner.close()


def test_a_linear_policy_is_exported_and_taken_in_beside_an_absorbing_state() -> None:
    settings = SACConfig(steps_per_round=8, learning_starts=4, batch_size=4, hidden=())
    learner = SACLearner(TASK, [0], settings, absorbing_scale=10.0, seed=0, total_steps=100)
    weights = learner.policy().weights
    assert weights["layers.0.weight"].shape == weights["log_std.weight"].shape == (2, 2)
    net = TrainablePolicy(learner.policy(), -2.0)
    with torch.no_grad():
        for p in net.parameters():
            p += 0.1
    learner.adopt(taken := net.export())
    batch = from_episodes(rollouts(TASK, taken, [3]))
    torch.testing.assert_close(learner.log_pi(batch), net(batch).detach(), atol=1e-4, rtol=1e-4)
    learner.close()


def test_it_learns_from_there() -> None:
    learner = learners()[1]
    before = learner.policy()
    learner.adopt(before)
    learner.start(lambda batch: batch.obs[:, 0])
    learner.collect()
    after = learner.policy().weights
    assert not np.array_equal(after["layers.0.weight"], before.weights["layers.0.weight"])
    learner.close()


def test_a_policy_of_other_sizes_is_refused_with_both() -> None:
    learner, other = learners()[0], pointmass.expert()
    with pytest.raises(ValueError, match=r"the learner has .* the policy"):
        learner.adopt(other)
    learner.close()
