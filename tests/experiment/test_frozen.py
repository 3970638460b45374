"""Which reward a policy is retrained on, and what is refused before anything is written."""

from pathlib import Path

import pytest

from irl.core.errors import UserError
from irl.core.nets import Normaliser
from irl.core.rng import torch_stream
from irl.experiment.frozen import frozen
from irl.learners.ppo import PPOConfig
from irl.rewards.artefact import save_reward
from irl.rewards.learned import RewardSpec
from irl.rewards.nets import LogitNet, LogitSpec
from tests.experiment.test_retrain import settings


def test_a_choice_of_actions_has_no_entropy_paid_beside_the_reward(tmp_path: Path) -> None:
    shape = LogitSpec(4, 2, (4,))
    spec = RewardSpec("CartPole-v1", "gail", "gail", "obs, action", shape, 0.99, 1.0, 128, {})
    save_reward(tmp_path / "reward", spec, LogitNet(shape, Normaliser(4), torch_stream(0, "net")))
    assert frozen(settings(PPOConfig(), "CartPole-v1"), tmp_path).spec == spec
    with pytest.raises(UserError, match=r"a choice of 2; use PPO's own bonus: --ppo.ent-coef 0.5"):
        frozen(settings(PPOConfig(), "CartPole-v1", entropy=0.5), tmp_path)
