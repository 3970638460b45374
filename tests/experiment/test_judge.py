"""The reward's part of evaluation.json on a reward whose anchor is known."""

import pytest

from irl.algorithms.probe import STRATA, Probe
from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import from_episodes
from irl.experiment.judge import judge_reward
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.nets import LogitNet, LogitSpec
from tests import pointmass


def test_what_a_step_pays_on_average_is_above_the_absorbing_state() -> None:
    episodes = pointmass.demonstrations(2)
    steps = from_episodes(episodes)
    shape = LogitSpec(2, 2, (8,), "tanh", absorbing_scale=10.0)
    net = LogitNet(shape, fitted_normaliser(steps.obs), torch_stream(0, "net"))
    spec = RewardSpec("PointMass-v0", "dac", "logit", "obs, action", shape, 0.98, 1.0, 0, {})
    probe = Probe(dict.fromkeys(STRATA, steps), {name: list(episodes) for name in STRATA})
    found = judge_reward(LearnedReward(spec, net), probe, seed=0)["strata"]["policy"]
    # as the figures and the episode's traces have it
    assert found["mean"] == pytest.approx((net(steps) - net.of_absorbing()).mean().item(), rel=1e-5)
    assert found["mean"] != pytest.approx(net(steps).mean().item(), rel=1e-2)
