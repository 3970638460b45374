"""Reading a reward episode by episode."""

import numpy as np
import torch

from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions, from_episodes
from irl.diagnostics.stack import read, read_episodes
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.nets import LogitNet, LogitSpec
from tests import pointmass


def total(batch: Transitions) -> torch.Tensor:
    return batch.obs.sum(dim=1)


def test_reading_follows_the_episodes() -> None:
    episodes = pointmass.demonstrations(2)
    per_episode = read_episodes(total, episodes)
    np.testing.assert_allclose(np.concatenate(per_episode), read(total, from_episodes(episodes)))
    assert [len(values) for values in per_episode] == [len(episode) for episode in episodes]


def test_an_episode_adds_up_to_what_its_steps_pay_above_the_absorbing_state() -> None:
    episodes = pointmass.demonstrations(1)
    shape = LogitSpec(2, 2, (), "tanh", absorbing_scale=10.0)
    net = LogitNet(shape, fitted_normaliser(from_episodes(episodes).obs), torch_stream(0, "net"))
    weight, bias = net.parameters()
    with torch.no_grad():
        weight.zero_()
        # a step is worth -1 and s_abs -2
        weight[0, -1], bias[0] = -0.1, -1.0
    spec = RewardSpec("PointMass-v0", "dac", "logit", "obs, action", shape, 0.98, 1.0, 0, {})
    (paid,) = read_episodes(LearnedReward(spec, net), episodes)
    assert paid.sum() == len(episodes[0])
