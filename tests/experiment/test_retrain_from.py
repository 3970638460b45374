"""Where a fresh policy begins, and where a run is too short for it to leave."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from irl.core.nets import Normaliser
from irl.core.rng import torch_stream
from irl.experiment import build
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig
from irl.learners.td3 import TD3Config
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.nets import LogitNet, LogitSpec
from tests.experiment.conftest import TASK
from tests.experiment.test_retrain import PPO, equal, policies, settings

PPO_SETTINGS = PPOConfig(n_envs=2, steps_per_round=128, batch_size=64, hidden=(8,))


def first(reward: LearnedReward, learner: PPOConfig | SACConfig | TD3Config, hand_written: bool) -> dict:
    """The weights of the policy before anything is learned."""
    algorithm = build.on_frozen(settings(learner, hand_written=hand_written), reward)
    algorithm.learner.close()
    return algorithm.learner.policy().weights


@pytest.mark.parametrize("learner", [PPO_SETTINGS, SACConfig(hidden=(8,)), TD3Config(hidden=(8,))])
@pytest.mark.parametrize("scale", [0.0, 10.0])
def test_the_hand_written_control_begins_alike_where_no_input_is_missing(
    learner: PPOConfig | SACConfig | TD3Config, scale: float
) -> None:
    """What --hand-written promises: off policy, one that knows an absorbing state has an input more."""
    spec = LogitSpec(2, 2, (8,), absorbing_scale=scale)
    net = LogitNet(spec, Normaliser(2), torch_stream(0, "net"))
    reward = LearnedReward(RewardSpec(TASK, "dac", "logit", "obs, action", spec, 0.99, 1.0, 0, {}), net)
    ours, control = first(reward, learner, False), first(reward, learner, True)
    assert equal(ours, control) == (scale == 0.0 or isinstance(learner, PPOConfig))
    for name in ("obs_mean", "obs_std"):
        np.testing.assert_array_equal(ours[name], control[name])


def test_a_round_of_ppo_at_rate_0_is_said_and_sac_without_an_update_refused(
    train: Callable[..., Path], irl: Callable[..., None], capfd: pytest.CaptureFixture
) -> None:
    train("gail")
    irl("retrain", "gail", "--out", "one", *PPO, "--steps=128")
    assert "irl: --steps 128 leaves the policy as it began: the first update of PPO" in capfd.readouterr().err
    before, after = policies("one")
    assert equal(before, after)
    irl("retrain", "gail", "--out", "two", *PPO, "--steps=129")
    assert "as it began" not in capfd.readouterr().err
    assert not equal(before, policies("two")[-1])
    with pytest.raises(SystemExit) as stopped:
        irl("retrain", "gail", "--algo=sac", "--steps=1000", "--out", "three")
    said = capfd.readouterr().err
    assert stopped.value.code == 2
    assert said.count("\n") == 1
    assert "first update of SAC is at step 1001, and the run ends at 1000; choose --steps 1002" in said
    assert not Path("three").exists()
