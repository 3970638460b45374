"""What Stable-Baselines3 does to a reward, and what must be undone when the reward comes afterwards."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from irl.core import state
from irl.core.nets import fitted_normaliser
from irl.core.types import Transitions, from_episodes
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.ppo_rollout import give_rewards
from tests import pointmass

SMALL = PPOConfig(
    n_envs=2,
    steps_per_round=128,
    batch_size=64,
    n_epochs=2,
    lr=3e-4,
    lr_schedule="constant",
    hidden=(16,),
    gamma=0.9,
)


def ones(batch: Transitions) -> Tensor:
    return torch.ones(len(batch))


def position(batch: Transitions) -> Tensor:
    return -batch.next_obs.norm(dim=1)


def learner(
    env_id: str = "PointMass-v0", config: PPOConfig = SMALL, seed: int = 0, **more: Any
) -> PPOLearner:
    normaliser = fitted_normaliser(from_episodes(pointmass.demonstrations(2)).obs)
    more = {"normaliser": normaliser, "total_steps": 1024} | more
    return PPOLearner(env_id, [seed, seed + 1], config, seed=seed, **more)


def weights(of: PPOLearner) -> dict[str, Tensor]:
    return {name: value.clone() for name, value in of.model.policy.state_dict().items()}


def test_actions_begin_in_the_middle_of_their_box() -> None:
    obs = np.random.default_rng(0).uniform(-1, 1, (50, 2))
    assert not weights(learner())["action_net.bias"].any()
    drawn = learner("Far-v0").policy()
    actions = np.stack([drawn(row) for row in obs])
    assert ((actions > 14.5) & (actions < 15.5)).all()


def test_the_value_behind_a_time_limit_is_added_on_the_learned_reward() -> None:
    ours = learner()
    batch = ours.collect()
    give_rewards(ours.model, ours._scale, batch, ones)
    scale = ours.reward_scale
    given = torch.from_numpy(ours.model.rollout_buffer.rewards).flatten()
    with torch.no_grad():
        behind = ours.model.policy.predict_values(batch.next_obs).flatten()
    expected = 1.0 / scale + torch.where(batch.truncated, SMALL.gamma * behind, torch.zeros(()))
    assert batch.truncated.any()
    torch.testing.assert_close(given, expected)


def test_nothing_is_added_where_the_task_ended_the_episode() -> None:
    ours = learner("Cliff-v0")
    # pushed to one side, so that episodes end at the cliff
    bias = ours.model.policy.action_net.bias
    assert isinstance(bias, torch.Tensor)
    torch.nn.init.constant_(bias, 1.0)
    batch = ours.collect()
    give_rewards(ours.model, ours._scale, batch, ones)
    given = torch.from_numpy(ours.model.rollout_buffer.rewards).flatten()
    assert batch.terminated.any()
    torch.testing.assert_close(
        given[batch.terminated], torch.full((int(batch.terminated.sum()),), 1.0 / ours.reward_scale)
    )


def test_advantages_are_those_of_a_slow_oracle_on_the_learned_reward() -> None:
    ours = learner("Cliff-v0")
    batch = ours.collect()
    give_rewards(ours.model, ours._scale, batch, position)
    model, buffer = ours.model, ours.model.rollout_buffer
    reward = position(batch).double().numpy() / ours.reward_scale
    with torch.no_grad():
        value = model.policy.predict_values(batch.obs).double().flatten().numpy()
        after = model.policy.predict_values(batch.next_obs).double().flatten().numpy()
    ended = (batch.terminated | batch.truncated).numpy()
    delta = reward + SMALL.gamma * np.where(batch.terminated, 0.0, after) - value
    for i in range(SMALL.n_envs):
        advantage = 0.0
        for t in reversed(range(model.n_steps)):
            row = t * SMALL.n_envs + i
            advantage = delta[row] + SMALL.gamma * SMALL.gae_lambda * (0.0 if ended[row] else advantage)
            assert abs(advantage - buffer.advantages[t, i]) < 1e-4


def test_the_batch_holds_the_clipped_actions_and_the_library_the_unclipped_ones() -> None:
    ours = learner(config=replace(SMALL, log_std_init=1.0))
    batch = ours.collect()
    stored = torch.from_numpy(ours.model.rollout_buffer.actions).reshape(-1, 2)
    assert (stored.abs() > 1).any()
    torch.testing.assert_close(batch.action, stored.clamp(-1, 1))


def test_the_environments_reward_replaced_by_nan_leaves_the_weights_bit_equal() -> None:
    ends = []
    for env_id in ("PointMass-v0", "NaNReward-v0"):
        ours = learner(env_id)
        for _ in range(3):
            ours.collect()
            ours.improve(position)
        ends.append(weights(ours))
    assert all(torch.equal(ends[0][name], ends[1][name]) for name in ends[0])
    assert all(value.isfinite().all() for value in ends[0].values())


def test_a_fixed_normaliser_stays_and_a_running_one_follows() -> None:
    fixed, running = learner(), learner(normaliser=None)
    before = fixed._normaliser.mean.clone()
    for ours in (fixed, running):
        batch = ours.collect()
        ours.improve(ones)
    assert torch.equal(fixed._normaliser.mean, before)
    torch.testing.assert_close(running._normaliser.mean, batch.obs.mean(0))


def test_the_exported_policy_is_a_copy_and_acts_as_the_library_predicts() -> None:
    ours = learner()
    exported = ours.policy()
    obs = np.random.default_rng(0).normal(size=(20, 2))
    predicted, _ = ours.model.predict(obs, deterministic=True)
    acted = np.array([exported(row) for row in obs])
    np.testing.assert_allclose(acted, predicted, atol=1e-6)
    ours.collect()
    ours.improve(position)
    np.testing.assert_array_equal(np.array([exported(row) for row in obs]), acted)


def test_a_last_round_past_the_end_learns_at_rate_zero() -> None:
    ours = learner(config=replace(SMALL, lr_schedule="linear"), total_steps=100)
    before = weights(ours)
    ours.collect()
    ours.improve(position)
    assert ours.env_steps == 128
    assert all(torch.equal(before[name], after) for name, after in weights(ours).items())


def test_a_linear_bonus_is_what_is_left_of_it() -> None:
    def after_a_round(**more: Any) -> dict[str, Tensor]:
        ours = learner(config=replace(SMALL, **more), total_steps=512)
        ours.collect()
        ours.improve(position)
        return weights(ours)

    a_quarter_gone = after_a_round(ent_coef=0.4, ent_schedule="linear")
    same = after_a_round(ent_coef=0.4 * 0.75)
    assert all(torch.equal(a_quarter_gone[name], same[name]) for name in same)
    whole = after_a_round(ent_coef=0.4)
    assert not torch.equal(a_quarter_gone["log_std"], whole["log_std"])


def test_a_round_past_the_runs_end_is_not_fined_for_entropy() -> None:
    ours = learner(config=replace(SMALL, ent_coef=0.4, ent_schedule="linear"), total_steps=100)
    ours.collect()
    ours.improve(position)
    assert ours.env_steps > 100
    assert ours.model.ent_coef == 0.0


def test_improving_twice_on_one_rollout_is_refused() -> None:
    ours = learner()
    ours.collect()
    ours.improve(ones)
    with pytest.raises(RuntimeError, match="collect a rollout"):
        ours.improve(ones)


def test_a_resumed_learner_ends_with_the_same_weights_to_the_bit(tmp_path: Any) -> None:
    config = replace(SMALL, lr_schedule="linear", average=0.5, ent_coef=0.1, ent_schedule="linear")
    straight = learner("Cliff-v0", config, normaliser=None)
    for round_ in range(6):
        straight.collect()
        straight.improve(position)
        if round_ == 2:
            state.save(tmp_path, straight.state_dict())
    torch.manual_seed(99)
    np.random.seed(99)  # noqa: NPY002
    resumed = learner("Cliff-v0", config, normaliser=None)
    resumed.load_state_dict(state.load(tmp_path))
    for _ in range(3):
        resumed.collect()
        resumed.improve(position)
    ours, theirs = weights(straight), weights(resumed)
    assert all(torch.equal(ours[name], theirs[name]) for name in ours)
    exported = straight.policy().weights, resumed.policy().weights
    assert all(np.array_equal(exported[0][name], exported[1][name]) for name in exported[0])
    assert straight.reward_scale == resumed.reward_scale
    assert straight.take_finished()[-3:] == resumed.take_finished()[-3:]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"gamma": 1.0}, "gamma"),
        ({"n_envs": 3}, "multiple"),
        ({"batch_size": 100}, "multiple"),
        ({"batch_size": 1}, "batch_size must be at least 2"),
        ({"max_grad_norm": 0.0}, "max_grad_norm must be above 0, not 0.0"),
        ({"gae_lambda": 1.1}, r"gae_lambda must be in \[0, 1\], not 1.1"),
        ({"gae_lambda": -0.1}, r"gae_lambda must be in \[0, 1\], not -0.1"),
    ],
)
def test_settings_that_contradict_are_refused(setting: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        PPOConfig(**setting)
