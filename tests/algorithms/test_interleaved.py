"""DAC's loop: one drawn batch for both players, and ends that are worth what the expert makes of them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from irl.algorithms.interleaved import Interleaved, InterleavedConfig, as_weighted, mixed
from irl.core.rng import torch_stream
from irl.core.types import Metrics, Transitions, from_episodes
from irl.envs.absorbing import subsample
from irl.learners.sac import SACConfig, SACLearner
from irl.learners.td3 import TD3Config, TD3Learner
from tests import pointmass

SMALL = SACConfig(steps_per_round=100, learning_starts=100, batch_size=16, hidden=(16,))


class Told:
    """A discriminator that writes down what it is asked, and rewards by how often it has learned."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, Transitions]] = []
        self.learned = 0

    def logits(self, batch: Transitions) -> torch.Tensor:
        return torch.zeros(len(batch))

    def reward(self, batch: Transitions) -> torch.Tensor:
        self.calls.append(("reward", batch))
        return torch.full((len(batch),), float(self.learned))

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        self.calls.append(("update", policy))
        assert len(expert) == len(policy)
        self.learned += 1
        return {"discriminator/loss": float(self.learned)}

    def state_dict(self) -> dict[str, Any]:
        return {"net": {}}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        raise AssertionError("not asked")


def with_td3(told: Told) -> Interleaved:
    small = TD3Config(steps_per_round=100, learning_starts=100, batch_size=16, hidden=(16,))
    learner = TD3Learner("Cliff-v0", [0], small, seed=0, total_steps=400, absorbing_scale=10.0)
    expert = from_episodes(pointmass.demonstrations(2))
    return Interleaved(learner, told, expert, InterleavedConfig(), torch_stream(0, "minibatches"))


def loop(told: Told, every: int = 1, scale: float = 10.0) -> Interleaved:
    learner = SACLearner("Cliff-v0", [0], SMALL, seed=0, total_steps=400, absorbing_scale=scale)
    expert = from_episodes(pointmass.demonstrations(2))
    return Interleaved(learner, told, expert, InterleavedConfig(every), torch_stream(0, "minibatches"))


def test_a_discriminator_that_wants_to_know_is_told_what_remains() -> None:
    class Asking(Told):
        def __init__(self) -> None:
            super().__init__()
            self.said: list[float] = []

        def anneal(self, remaining: float) -> None:
            self.said.append(remaining)

    list(loop(told := Asking()).rounds(400))
    assert told.said == [1.0, 0.75, 0.5, 0.25]


def test_the_discriminator_learns_from_each_batch_before_it_rewards_it() -> None:
    told = Told()
    rounds = list(loop(told).rounds(300))
    names = [name for name, _ in told.calls]
    assert names == ["update", "reward"] * 200
    pairs = list(zip(told.calls[::2], told.calls[1::2], strict=True))
    assert all(of_update is of_reward for (_, of_update), (_, of_reward) in pairs)
    # the first round is random; the second's mean is that of 1..100
    assert "discriminator/loss" not in rounds[0].metrics
    assert rounds[1].metrics["discriminator/loss"] == pytest.approx(50.5)
    assert rounds[2].metrics["discriminator/loss"] == pytest.approx(150.5)


def test_a_rest_that_fills_no_round_is_played_too() -> None:
    assert [round_.env_steps for round_ in loop(Told()).rounds(250)] == [100, 200, 300]


def test_a_learner_without_log_pi_is_never_asked_for_it() -> None:
    told = Told()
    rounds = list(with_td3(told).rounds(300))
    assert [name for name, _ in told.calls] == ["update", "reward"] * 200
    assert {"td3/actor_loss", "td3/critic_loss"} <= rounds[-1].metrics.keys()


def test_every_second_update_is_half_as_many() -> None:
    told = Told()
    rounds = list(loop(told, every=2).rounds(300))
    assert told.learned == 100
    assert rounds[1].metrics["discriminator/loss"] == pytest.approx(25.5)


@pytest.mark.parametrize("scale", [0.0, 10.0])
def test_terminations_lead_into_the_absorbing_state_where_there_is_one(scale: float) -> None:
    told = Told()
    list(loop(told, scale=scale).rounds(400))
    batches = [batch for name, batch in told.calls if name == "update"]
    if not scale:
        assert any(batch.terminated.any() for batch in batches)
        assert all(batch.absorbing is None for batch in batches)
        return
    assert not any(batch.terminated.any() for batch in batches)
    loops = into = 0
    for batch in batches:
        assert batch.absorbing is not None
        assert batch.next_absorbing is not None
        loops += int(batch.absorbing.sum())
        into += int((batch.next_absorbing & ~batch.absorbing).sum())
    # as many steps in s_abs as steps into it, but for the luck of the draw
    assert 0.5 < loops / into < 2.0


def test_settings_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match="every must be at least 1"):
        replace(InterleavedConfig(), every=0)


def test_a_share_of_what_is_learned_from_is_the_experts() -> None:
    told = Told()
    algorithm = loop(told)
    algorithm.schedule = InterleavedConfig(expert_share=0.25)
    list(algorithm.rounds(200))
    seen = [batch for name, batch in told.calls if name == "update"]
    learned = [batch for name, batch in told.calls if name == "reward"]
    known = {tuple(row.tolist()) for row in algorithm.expert.obs}
    for of_update, of_reward in zip(seen, learned, strict=True):
        assert len(of_reward) == len(of_update) == 16
        assert all(tuple(row.tolist()) in known for row in of_reward.obs[:4])
        # the discriminator learns from the whole drawn batch, the learner from what is left of it
        assert torch.equal(of_reward.obs[4:], of_update.obs[4:])
        assert not torch.equal(of_reward.obs[:4], of_update.obs[:4])


def test_the_experts_share_of_thinned_demonstrations_is_as_weighty_as_their_steps() -> None:
    episodes = [replace(episode, terminated=True) for episode in pointmass.demonstrations(4)]
    expert = subsample(episodes, 10, np.random.default_rng(0), absorbing=True)
    assert expert.weight is not None
    assert expert.absorbing is not None
    into = expert.absorbing | expert.terminated
    wanted = float(expert.weight[into].sum() / expert.weight.sum())
    assert float(into.double().mean()) > 2 * wanted

    def seen(batch: Transitions) -> torch.Tensor:
        assert batch.absorbing is not None
        return batch.absorbing

    rng = torch_stream(0, "minibatches")
    drawn = [as_weighted(expert.sample(200, rng), rng) for _ in range(50)]
    found = np.mean([float((batch.terminated | seen(batch)).double().mean()) for batch in drawn])
    assert found == pytest.approx(wanted, rel=0.2)
    plain = replace(expert, weight=None)
    assert as_weighted(plain, rng) is plain


def test_no_share_is_the_drawn_batch_itself() -> None:
    batch = from_episodes(pointmass.demonstrations(1))
    assert mixed(batch, batch, 0.0) is batch


@pytest.mark.parametrize("share", [-0.1, 1.0])
def test_a_share_is_below_one(share: float) -> None:
    with pytest.raises(ValueError, match="expert_share must be in"):
        InterleavedConfig(expert_share=share)
