"""TD3 beside a reward: plays with noise, is saved and goes on, exports what it does, and learns."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from irl.core import state
from irl.core.log import Logs
from irl.core.nets import Normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.envs.rollouts import rollouts
from irl.learners.td3 import TD3Config, TD3Learner
from irl.policies.trainable import TrainablePolicy, drawing
from irl.rewards.mujoco import HandWritten
from tests import pointmass

SMALL = TD3Config(steps_per_round=100, learning_starts=150, batch_size=32, hidden=(16,), buffer_size=1000)


def learner(env_id: str = "Cliff-v0", config: TD3Config = SMALL, **more: Any) -> TD3Learner:
    return TD3Learner(env_id, [0], config, seed=0, total_steps=600, **more)


def weights(of: TD3Learner) -> dict[str, Tensor]:
    return {name: value.clone() for name, value in of.model.policy.state_dict().items()}


def position(batch: Transitions) -> Tensor:
    return -batch.next_obs.norm(dim=1)


@pytest.mark.parametrize("absorbing_scale", [0.0, 10.0])
def test_a_resumed_learner_ends_with_the_same_weights_to_the_bit(
    tmp_path: Path, absorbing_scale: float
) -> None:
    # an odd number of updates a round: the actor's turn is part of the state
    config = replace(SMALL, lr_schedule="linear", average=0.5, products="bfloat16", updates_per_step=0.77)
    straight = learner(config=config, absorbing_scale=absorbing_scale)
    straight.start(HandWritten())
    for round_ in range(5):
        straight.collect()
        if round_ == 2:
            assert straight._update.updates % 2 == 1
            state.save(tmp_path, straight.state_dict(), Logs(tmp_path / "logs"))
    torch.manual_seed(99)
    resumed = learner(config=config, absorbing_scale=absorbing_scale)
    resumed.load_state_dict(state.load(tmp_path, Logs(tmp_path / "logs")))
    resumed.start(HandWritten())
    for _ in range(2):
        resumed.collect()
    ours, theirs = weights(straight), weights(resumed)
    assert all(torch.equal(ours[name], theirs[name]) for name in ours)
    assert straight.env_steps == resumed.env_steps == 500


def test_the_noise_that_it_plays_with_is_a_stream_of_its_own_and_of_its_deviation() -> None:
    ours = learner("Pendulum-v1", replace(SMALL, exploration_noise=0.01))
    obs = torch.zeros(5, 3)
    played = ours._explore(ours._update.inputs.features(obs))
    noise = torch.randn(5, 1, generator=torch_stream(0, "exploration"))
    torch.testing.assert_close(played, ours._update.act(obs) + 0.01 * noise)
    # environment units, within them
    ours.start(position)
    batch = [ours.collect(), ours.collect()][-1]
    assert 1.0 < float(batch.action.abs().max()) <= 2.0
    ours.close()


def test_nan_from_the_environment_leaves_the_weights_bit_equal() -> None:
    ends = []
    for env_id in ("PointMass-v0", "NaNReward-v0"):
        ours = learner(env_id)
        ours.start(position)
        for _ in range(3):
            ours.collect()
        ends.append(weights(ours))
    assert all(torch.equal(ends[0][name], ends[1][name]) for name in ends[0])


@pytest.mark.parametrize("absorbing_scale", [0.0, 10.0])
def test_the_exported_policy_acts_as_the_library_predicts_and_never_draws(absorbing_scale: float) -> None:
    ours = learner("Pendulum-v1", normaliser=Normaliser(3, 4.0), absorbing_scale=absorbing_scale)
    exported, rng = ours.policy(), np.random.default_rng(0)
    assert exported.spec.distribution == "deterministic"
    for obs in rng.normal(size=(10, 3)) * 5:
        own = np.pad(obs, (0, int(absorbing_scale > 0))).astype(np.float32)
        predicted, _ = ours.model.predict(own, deterministic=True)
        np.testing.assert_allclose(exported(obs), predicted, atol=1e-5)
        np.testing.assert_array_equal(exported.sample(obs, rng), exported(obs))


def test_it_has_no_log_pi_and_says_so() -> None:
    ours = learner()
    ours.start(position)
    batch = ours.collect()
    with pytest.raises(TypeError, match="no log pi; use SAC or PPO"):
        ours.log_pi(batch)
    with pytest.raises(ValueError, match="no log pi"):
        TrainablePolicy(ours.policy(), -2.0)(batch)


def test_a_cloned_policy_is_taken_in_by_the_actor_and_its_target() -> None:
    ours = learner(absorbing_scale=10.0)
    net = TrainablePolicy(drawing(ours.policy()), -2.0)
    with torch.no_grad():
        for p in net.parameters():
            p += 0.1
    ours.adopt(cloned := net.export())
    np.testing.assert_array_equal(ours.policy()(np.ones(2)), cloned(np.ones(2)))
    # the last number says that this is no absorbing state
    acted, _ = ours.model.predict(np.array([1.0, 1.0, 0.0], np.float32), deterministic=True)
    np.testing.assert_allclose(acted, cloned(np.ones(2)), atol=1e-5)
    for mine, its in zip(ours.model.actor.parameters(), ours.model.actor_target.parameters(), strict=True):
        assert torch.equal(mine, its)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"policy_delay": 0}, "policy_delay must be at least 1"),
        ({"exploration_noise": -0.1}, "exploration_noise must be at least 0"),
        ({"n_envs": 3}, "steps_per_round must be a multiple"),
    ],
)
def test_settings_that_contradict_are_refused(setting: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TD3Config(**setting)


def test_it_learns_the_point_mass_to_nine_tenths_of_the_expert() -> None:
    """In 1500 steps, of which 500 are random; two seeds came to .97 and .94."""
    small = TD3Config(steps_per_round=500, learning_starts=500, batch_size=64, hidden=(32, 32))
    config = replace(small, gamma=0.9, lr=3e-3, tau=0.02)
    ours = TD3Learner("PointMass-v0", [0], config, seed=0, total_steps=1500)
    ours.start(position)

    def score() -> float:
        return float(np.mean([e.return_ for e in rollouts("PointMass-v0", ours.policy(), range(10))]))

    before = score()
    for _ in range(3):
        ours.collect()
    ours.close()
    best = float(np.mean([e.return_ for e in pointmass.demonstrations(10)]))
    assert (score() - before) / (best - before) > 0.9
