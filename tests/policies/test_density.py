"""The density of an exported policy is that of the learner that it was exported from."""

from typing import cast

import pytest
import torch

from irl.learners.ppo import PPOLearner
from irl.learners.sac import SACLearner
from irl.policies.density import Density
from tests.policies.test_densities import a_ppo, a_sac, zeros


@pytest.mark.parametrize("make", [a_ppo, a_sac])
def test_it_is_the_learners_own(make) -> None:
    learner = cast("PPOLearner | SACLearner", make())
    learner.start(zeros)
    learner.collect()
    learner.improve(zeros)
    batch = learner.collect()
    found = Density(learner.policy())(batch)
    torch.testing.assert_close(found, learner.log_pi(batch), atol=1e-4, rtol=1e-4)
    assert float(found.std()) > 0.1
