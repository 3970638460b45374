"""The adversarial loop: its order, and that it learns a task that survival alone does not solve."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from irl.algorithms.adversarial import Adversarial, ReplayedScheduleConfig, ScheduleConfig, judge
from irl.algorithms.loop import BeforeUpdate
from irl.core.finite import NotFinite
from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import Metrics, RewardFn, Transitions, from_episodes
from irl.discriminators.gail import GAIL, GAILConfig
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollouts
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.policies.card import normalised_score, summary
from tests import pointmass


class Told:
    """A learner and a discriminator that write down what they are asked, in one list."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.env_steps, self.reward_scale = 0, 1.0
        self._batch = from_episodes(pointmass.demonstrations(1))

    def start(self, reward: RewardFn, before_update: BeforeUpdate | None = None) -> None:
        self.calls.append("start")

    def collect(self) -> Transitions:
        self.calls.append("collect")
        self.env_steps += len(self._batch)
        return self._batch

    def improve(self, reward: RewardFn) -> Metrics:
        self.calls.append("improve")
        reward(self._batch)
        return {}

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        self.calls.append(f"update {len(expert)} {len(policy)}")
        return {"discriminator/loss": 1.0}

    def logits(self, batch: Transitions) -> torch.Tensor:
        return torch.ones(len(batch))

    def reward(self, batch: Transitions) -> torch.Tensor:
        self.calls.append("reward")
        return torch.ones(len(batch))

    def _not_asked(self) -> Any:
        raise AssertionError("a round asks for no such thing")

    take_finished = policy = close = _not_asked

    def log_pi(self, batch: Transitions) -> torch.Tensor:
        return self._not_asked()

    def state_dict(self) -> dict[str, Any]:
        return {"net": {}}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self._not_asked()


def test_the_discriminator_learns_before_the_rollout_is_rewarded() -> None:
    told = Told()
    schedule = ScheduleConfig(batch_size=15, epochs=2)
    expert = from_episodes(pointmass.demonstrations(2))
    loop = Adversarial(told, told, expert, schedule, torch_stream(0, "minibatches"))
    rounds = list(loop.rounds(2 * pointmass.STEPS))
    # 30 steps are two minibatches of 15, passed over twice
    first = ["start", "collect", *["update 15 15"] * 4, "improve", "reward"]
    assert told.calls == [*first, "collect", *["update 15 15"] * 4, "improve", "reward"]
    assert [(r.index, r.env_steps) for r in rounds] == [(1, 30), (2, 60)]
    assert rounds[0].metrics["discriminator/loss"] == 1.0
    assert rounds[0].metrics["discriminator/accuracy_expert"] == 1.0
    assert rounds[0].metrics["discriminator/accuracy_policy"] == 0.0


def test_a_discriminator_that_wants_to_know_is_told_what_remains() -> None:
    class Asking(Told):
        def anneal(self, remaining: float) -> None:
            self.calls.append(f"{remaining:.2f} remains")

    told = Asking()
    expert = from_episodes(pointmass.demonstrations(2))
    loop = Adversarial(told, told, expert, ScheduleConfig(15), torch_stream(0, "minibatches"))
    list(loop.rounds(4 * pointmass.STEPS))
    said = [call for call in told.calls if call in ("collect", "improve") or "remains" in call]
    assert said == [
        word
        for share in ("1.00", "0.75", "0.50", "0.25")
        for word in (f"{share} remains", "collect", "improve")
    ]


def test_a_round_reports_the_mean_over_all_its_minibatches() -> None:
    class Counting(Told):
        def update(self, expert: Transitions, policy: Transitions) -> Metrics:
            super().update(expert, policy)
            return {"discriminator/loss": float(len(self.calls))}

    told = Counting()
    expert = from_episodes(pointmass.demonstrations(2))
    loop = Adversarial(told, told, expert, ScheduleConfig(15, epochs=2), torch_stream(0, "minibatches"))
    # after "start" and "collect" four updates, the 3rd to the 6th call
    assert next(loop.rounds(30)).metrics["discriminator/loss"] == pytest.approx((3 + 4 + 5 + 6) / 4)


class Numbered(Told):
    """Rollout i has i everywhere."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: list[set[float]] = []

    def collect(self) -> Transitions:
        self.seen.append(set())
        batch = super().collect()
        return replace(batch, obs=torch.full_like(batch.obs, len(self.seen)))

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        self.seen[-1] |= set(policy.obs.flatten().tolist())
        return super().update(expert, policy)


def shown(schedule: ScheduleConfig) -> Numbered:
    """What a discriminator is told in four rounds of this schedule."""
    told = Numbered()
    expert = from_episodes(pointmass.demonstrations(2))
    loop = Adversarial(told, told, expert, schedule, torch_stream(0, "minibatches"))
    list(loop.rounds(4 * pointmass.STEPS))
    return told


def test_the_first_rounds_are_longer_and_earlier_rollouts_are_shown_again() -> None:
    told = shown(ReplayedScheduleConfig(10, 4, warmup_rounds=2, warmup_epochs=6, negatives=2, memory=0))
    rounds = " ".join(told.calls).split("collect")[1:]
    # a pass is as long as a rollout, three minibatches, however many rollouts it draws from
    assert [said.count("update 10 10") for said in rounds] == [18, 18, 12, 12]
    assert told.seen == [{1.0}, {1.0, 2.0}, {2.0, 3.0}, {3.0, 4.0}]


def test_a_memory_shows_every_earlier_rollout_again_in_passes_as_long() -> None:
    told = shown(ScheduleConfig(10, epochs=8, memory=1000))
    assert told.seen == [{1.0}, {1.0, 2.0}, {1.0, 2.0, 3.0}, {1.0, 2.0, 3.0, 4.0}]
    assert told.calls.count("update 10 10") == 4 * 8 * 3
    assert shown(ScheduleConfig(10, epochs=8)).seen == [{1.0}, {2.0}, {3.0}, {4.0}]


def _gail(seed: int, trained: bool = True) -> Adversarial:
    expert = from_episodes(pointmass.demonstrations(4))
    normaliser = fitted_normaliser(expert.obs)
    config = PPOConfig(
        n_envs=4, steps_per_round=512, batch_size=128, n_epochs=10, gamma=0.9, hidden=(32,), lr=1e-3
    )
    learner = PPOLearner(
        "PointMass-v0", [seed * 10 + i for i in range(4)], config, seed=seed, total_steps=10**6
    )
    discriminator = GAIL(
        2,
        2,
        GAILConfig(hidden=(32,), lr=3e-3 if trained else 0.0, gradient_penalty=1.0),
        normaliser=normaliser,
        init_rng=torch_stream(seed, "discriminator weights"),
        rng=torch_stream(seed, "discriminator"),
    )
    # at 3 passes a round D stays behind the policy (its loss is above log 4) and leads it astray
    schedule = ScheduleConfig(batch_size=128, epochs=10)
    return Adversarial(learner, discriminator, expert, schedule, torch_stream(seed, "minibatches"))


def _score(loop: Adversarial) -> float:
    """Normalised score of the final deterministic policy in 20 episodes of its own."""
    env = make("PointMass-v0")
    random = random_act(env.action_space, np.random.default_rng(0))
    means = [
        summary(rollouts("PointMass-v0", act, range(1000, 1020))).return_mean
        for act in (loop.learner.policy(), random, pointmass.expert())
    ]
    return normalised_score(*means)


def test_gail_learns_the_point_mass_to_nine_tenths_of_the_expert() -> None:
    loop = _gail(0)
    for _ in loop.rounds(10_240):
        pass
    assert _score(loop) >= 0.9


def test_an_untrained_discriminator_does_not_teach_it() -> None:
    # the control: what the test above shows is the discriminator's doing
    loop = _gail(0, trained=False)
    for _ in loop.rounds(5_120):
        pass
    assert _score(loop) < 0.5


def test_the_same_seed_gives_the_same_weights_to_the_bit() -> None:
    ends = []
    for _ in range(2):
        loop = _gail(3)
        for _ in loop.rounds(1024):
            pass
        ends.append(loop.learner.policy().weights)
    assert all(np.array_equal(ends[0][name], ends[1][name]) for name in ends[0])


def test_a_discriminator_that_is_not_finite_stops_the_round_before_it_rewards() -> None:
    class Broken(Told):
        def state_dict(self) -> dict[str, Any]:
            return {"net": {"body.0.weight": torch.tensor([1.0, float("nan")])}}

    told = Broken()
    expert = from_episodes(pointmass.demonstrations(2))
    loop = Adversarial(told, told, expert, ScheduleConfig(batch_size=15), torch_stream(0, "minibatches"))
    with pytest.raises(NotFinite, match=r"^discriminator body\.0\.weight \(1 of 2 numbers"):
        next(loop.rounds(30))
    assert "reward" not in told.calls


def test_demonstrations_are_judged_by_their_weights() -> None:
    class First(Told):
        def logits(self, batch: Transitions) -> torch.Tensor:
            return batch.obs[:, 0]

    obs = torch.tensor([[1.0, 0.0], [-3.0, 0.0]])
    expert = from_episodes(pointmass.demonstrations(1))[torch.tensor([0, 1])]
    expert = replace(expert, obs=obs, weight=torch.tensor([0.75, 0.25]))
    found = judge(First(), expert, replace(expert, obs=-obs))
    assert found["discriminator/accuracy_expert"] == 0.75
    assert found["discriminator/logit_expert"] == 0.0
    # the policy's are its own steps, each once
    assert found["discriminator/accuracy_policy"] == 0.5
