"""SAC rewarded as batches are drawn: in the right units, with the right ends, never stale."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from irl.core import state
from irl.core.flat import linear_layers
from irl.core.log import Logs
from irl.core.nets import NO_CLIP, Normaliser, fitted_normaliser
from irl.core.types import Transitions
from irl.learners.sac import SACConfig, SACLearner
from irl.rewards.mujoco import HandWritten
from tests import pointmass  # noqa: F401 (registers the tasks)

SMALL = SACConfig(steps_per_round=100, learning_starts=150, batch_size=32, hidden=(16,), buffer_size=1000)


def learner(env_id: str = "Cliff-v0", config: SACConfig = SMALL, seed: int = 0) -> SACLearner:
    return SACLearner(env_id, [seed], config, seed=seed, total_steps=600)


def weights(of: SACLearner) -> dict[str, Tensor]:
    return {name: value.clone() for name, value in of.model.policy.state_dict().items()}


def rows(*columns: Tensor) -> set[tuple[float, ...]]:
    return {tuple(np.round(row, 4)) for row in torch.cat(columns, 1).tolist()}


def test_a_drawn_batch_is_judged_in_environment_units_with_the_newest_reward() -> None:
    seen: list[Transitions] = []

    def remember(batch: Transitions) -> Tensor:
        seen.append(batch)
        return batch.obs[:, 0]

    ours = learner("Pendulum-v1")  # actions within +-2
    ours.start(HandWritten())
    steps = [ours.collect(), ours.collect()]
    ours.improve(remember)
    steps.append(ours.collect())
    assert len(seen) == 100
    assert {len(batch) for batch in seen} == {32}
    judged = set.union(*(rows(batch.obs, batch.action) for batch in seen))
    assert judged <= set.union(*(rows(batch.obs, batch.action) for batch in steps))
    assert max(float(batch.action.abs().max()) for batch in seen) > 1.5


def test_a_time_limit_is_no_termination_and_the_next_observation_is_the_true_one() -> None:
    ours = learner("PointMass-v0")
    ours.start(HandWritten())
    steps = ours.collect()
    assert steps.truncated.any()
    drawn = ours.replay.sample(500, torch.Generator().manual_seed(0))
    assert not drawn.terminated.any()
    assert drawn.truncated.any()
    assert rows(drawn.obs, drawn.next_obs) <= rows(steps.obs, steps.next_obs)


def test_the_environments_own_reward_is_there_for_a_reward_that_asks() -> None:
    ours = learner()
    ours.start(HandWritten())
    steps = ours.collect()
    drawn = ours.replay.sample(200, torch.Generator().manual_seed(0))
    assert steps.reward is not None
    assert drawn.reward is not None
    assert set(np.round(drawn.reward.double().numpy(), 4)) <= set(np.round(steps.reward.numpy(), 4))


def test_half_an_update_a_step_of_several_environments_is_half_as_many() -> None:
    drawn = 0

    def count(batch: Transitions) -> Tensor:
        nonlocal drawn
        drawn += 1
        return torch.zeros(len(batch))

    config = replace(SMALL, n_envs=4, updates_per_step=0.5, learning_starts=100)
    ours = SACLearner("Cliff-v0", [1, 2, 3, 4], config, seed=0, total_steps=600)
    ours.start(count)
    sizes = [len(ours.collect()) for _ in range(3)]
    assert sizes == [100, 100, 100]
    assert drawn == 100


def test_nan_from_the_environment_leaves_the_weights_bit_equal() -> None:
    ends = []
    for env_id in ("PointMass-v0", "NaNReward-v0"):
        ours = learner(env_id)
        ours.start(lambda batch: -batch.next_obs.norm(dim=1))
        for _ in range(3):
            ours.collect()
        ends.append(weights(ours))
    assert all(torch.equal(ends[0][name], ends[1][name]) for name in ends[0])


def test_the_exported_policy_acts_as_the_library_predicts() -> None:
    ours = learner("Pendulum-v1")
    exported = ours.policy()
    for obs in np.random.default_rng(0).normal(size=(10, 3)):
        predicted, _ = ours.model.predict(obs.astype(np.float32), deterministic=True)
        np.testing.assert_allclose(exported(obs), predicted, atol=1e-5)


def test_without_a_normaliser_nothing_is_cut_and_with_one_it_is_cut_at_its_bound() -> None:
    """What learns, what acts and what is exported agree on it."""
    obs = torch.tensor([[0.5, -50.0, 12.0]])
    bounds: list[tuple[Normaliser | None, float]] = [(None, NO_CLIP), (Normaliser(3, 4.0), 4.0)]
    for normaliser, bound in bounds:
        ours = SACLearner("Pendulum-v1", [0], SMALL, seed=0, total_steps=600, normaliser=normaliser)
        seen = ours._update.inputs.features(obs)
        assert torch.equal(seen, obs.clamp(-bound, bound))
        assert torch.equal(ours.model.actor.features_extractor(obs), seen)
        assert float(ours.policy().weights["obs_clip"]) == bound
        ours.close()
    # the bound of a fitted one is what every policy without its own has
    fitted = fitted_normaliser(torch.randn(50, 3))
    ours = SACLearner("Pendulum-v1", [0], SMALL, seed=0, total_steps=600, normaliser=fitted)
    assert "obs_clip" not in ours.policy().weights
    ours.close()


def trained(**changes: Any) -> SACLearner:
    ours = learner(config=replace(SMALL, **changes))
    ours.start(HandWritten())
    for _ in range(3):
        ours.collect()
    return ours


def test_a_temperature_stays_where_it_was_put_or_is_learned_from_there() -> None:
    fixed, low, entropic = trained(ent_coef="0.2"), trained(ent_coef="auto_0.1"), trained(target_entropy="5")
    assert fixed.improve(HandWritten())["sac/ent_coef"] == pytest.approx(0.2)
    learned = low.improve(HandWritten())["sac/ent_coef"]
    assert learned == pytest.approx(0.1, rel=0.2)
    assert learned != pytest.approx(0.1, rel=1e-4)
    # more entropy than two actions within +-1 can have, log 4: the temperature can only rise
    assert entropic.improve(HandWritten())["sac/ent_coef"] > 1.0


def test_target_critics_follow_at_every_third_update_only() -> None:
    ours = learner(config=replace(SMALL, target_update_interval=3))
    ours.start(HandWritten())
    ours.collect()
    moved = []
    for _ in range(6):
        before = ours.model.critic_target.state_dict()["qf0.0.weight"].clone()
        ours._learn()
        moved.append(not torch.equal(ours.model.critic_target.state_dict()["qf0.0.weight"], before))
    assert moved == [False, False, True] * 2


def test_a_learner_without_hidden_layers_has_quantiles_too() -> None:
    ours = learner(config=replace(SMALL, hidden=(), quantiles=5))
    assert [linear_layers(net)[-1].out_features for net in ours.model.critic.q_networks] == [5, 5]


def test_more_critics_and_their_quantiles_are_outputs_of_the_models_own() -> None:
    ours = trained(n_critics=3, quantiles=7, dropped_quantiles=1)
    critic, target = ours.model.critic, ours.model.critic_target
    assert [linear_layers(net)[-1].out_features for net in critic.q_networks] == [7, 7, 7]
    fresh = learner(config=replace(SMALL, n_critics=3, quantiles=7, dropped_quantiles=1)).model
    for name, weight in fresh.critic.state_dict().items():
        # the targets began as copies, and all of them were trained
        assert torch.equal(fresh.critic_target.state_dict()[name], weight)
        assert not torch.equal(critic.state_dict()[name], weight) or "normaliser" in name
        assert not torch.equal(target.state_dict()[name], weight) or "normaliser" in name


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"ent_coef": "auto_auto"}, "ent_coef must be auto, auto_0.1 or a number above 0, not 'auto_auto'"),
        ({"ent_coef": "0"}, "ent_coef must be"),
        ({"target_entropy": "nan"}, "target_entropy must be auto or a number, not 'nan'"),
        ({"target_update_interval": 0}, "target_update_interval must be at least 1"),
        ({"quantiles": 2}, r"dropped_quantiles must be below quantiles \(2\), not 2"),
        ({"n_envs": 3}, "steps_per_round must be a multiple"),
    ],
)
def test_settings_that_contradict_are_refused(setting: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SACConfig(**setting)


def test_rounds_before_anything_is_learned_count_nothing_in_the_average(tmp_path: Path) -> None:
    config = replace(SMALL, learning_starts=200, average=0.9, lr=1e-2)
    ours = learner(config=config)
    ours.start(HandWritten())
    first = weights(ours)
    for _ in range(2):
        ours.collect()
    assert all(torch.equal(first[name], value) for name, value in weights(ours).items())
    state.save(tmp_path, ours.state_dict(), Logs(tmp_path / "logs"))
    resumed = learner(config=config)
    resumed.load_state_dict(state.load(tmp_path, Logs(tmp_path / "logs")))
    resumed.start(HandWritten())
    for one in (ours, resumed):
        one.collect()
        newest = one._weights()
        # the random start is forgotten
        assert all(torch.equal(newest[name], value) for name, value in one._average.weights.items())
    assert all(torch.equal(ours._weights()[name], value) for name, value in resumed._weights().items())
    ours.collect()
    assert not any(torch.equal(ours._weights()[name], value) for name, value in ours._average.weights.items())


@pytest.mark.parametrize("more", [{}, {"quantiles": 5, "target_update_interval": 3, "ent_coef": "0.1"}])
def test_a_resumed_learner_ends_with_the_same_weights_to_the_bit(
    tmp_path: Path, more: dict[str, Any]
) -> None:
    config = replace(SMALL, lr_schedule="linear", average=0.5, products="bfloat16", updates_per_step=0.7)
    config = replace(config, **more)
    straight = learner(config=config)
    straight.start(HandWritten())
    for round_ in range(5):
        straight.collect()
        if round_ == 2:
            state.save(tmp_path, straight.state_dict(), Logs(tmp_path / "logs"))
    torch.manual_seed(99)
    resumed = learner(config=config)
    resumed.load_state_dict(state.load(tmp_path, Logs(tmp_path / "logs")))
    resumed.start(HandWritten())
    for _ in range(2):
        resumed.collect()
    ours, theirs = weights(straight), weights(resumed)
    assert all(torch.equal(ours[name], theirs[name]) for name in ours)
    assert straight.env_steps == resumed.env_steps == 500
