"""What a learner's own entropy pays beside a reward."""

import math

import numpy as np
import pytest
import torch

from irl.core.types import Transitions
from irl.rewards.entropic import Entropic


def actions(action: torch.Tensor) -> Transitions:
    nothing, flags = torch.zeros(len(action), 1), torch.zeros(len(action), dtype=torch.bool)
    return Transitions(nothing, action, nothing, flags, flags)


@pytest.mark.parametrize("temperature", [0.0, 0.5, 1.0])
def test_its_mean_is_that_of_the_reward_and_the_entropy(temperature: float) -> None:
    # a ~ N(0, std^2) has an entropy of log(std sqrt(2 pi e)), and E[-a^2] = -std^2
    std = 0.7
    drawn = torch.from_numpy(np.random.default_rng(0).normal(0.0, std, (200_000, 1)))

    def log_pi(batch: Transitions) -> torch.Tensor:
        return torch.distributions.Normal(0.0, std).log_prob(batch.action[:, 0])

    paid = Entropic(lambda batch: -batch.action[:, 0].square(), log_pi, temperature)(actions(drawn))
    expected = -(std**2) + temperature * math.log(std * math.sqrt(2 * math.pi * math.e))
    assert paid.mean().item() == pytest.approx(expected, abs=0.01)


def test_an_action_that_is_all_but_impossible_or_certain_pays_the_bound() -> None:
    paid = Entropic(lambda batch: torch.ones(len(batch)), lambda batch: batch.action[:, 0], 2.0, bound=3.0)
    assert paid(actions(torch.tensor([[-50.0], [0.5], [50.0]]))).tolist() == [7.0, 0.0, -5.0]


def test_of_all_policies_the_one_that_is_as_sure_as_the_reward_is_steep_is_paid_most() -> None:
    # max_std E[-a^2 / (2 s^2)] + H(std)  is at std = s
    s, stds = 0.5, np.linspace(0.1, 1.5, 141)
    u = torch.from_numpy(np.random.default_rng(1).normal(size=(20_000, 1)))

    def mean(std: float) -> float:
        normal = torch.distributions.Normal(0.0, std)
        reward = Entropic(
            lambda batch: -batch.action[:, 0].square() / (2 * s * s),
            lambda batch: normal.log_prob(batch.action[:, 0]),
            1.0,
        )
        return reward(actions(u * std)).mean().item()

    assert stds[int(np.argmax([mean(std) for std in stds]))] == pytest.approx(s, abs=0.02)
