"""The rollouts that a discriminator is shown: which, in which order, and across a checkpoint."""

from dataclasses import replace
from pathlib import Path

import torch

from irl.algorithms.negatives import Negatives
from irl.core import state
from irl.core.types import Transitions


def rollout(number: int, terminated: bool = False) -> Transitions:
    flags = torch.tensor([False, terminated])
    obs = torch.full((2, 1), float(number))
    return Transitions(obs, obs, obs, flags, ~flags, reward=torch.ones(2, dtype=torch.float64))


def shown(of: Transitions) -> list[float]:
    return of.obs[:, 0].tolist()


def test_the_last_three_are_shown_oldest_first() -> None:
    negatives = Negatives(3)
    found = [shown(negatives.with_newest(rollout(i))) for i in range(1, 6)]
    assert found[0] == [1.0, 1.0]
    assert found[1] == [1.0, 1.0, 2.0, 2.0]
    assert found[2] == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert found[3] == [2.0, 2.0, 3.0, 3.0, 4.0, 4.0]
    assert found[4] == [3.0, 3.0, 4.0, 4.0, 5.0, 5.0]


def test_of_one_only_the_newest_is_and_nothing_is_kept() -> None:
    negatives = Negatives(1)
    assert [shown(negatives.with_newest(rollout(i))) for i in (1, 2)] == [[1.0, 1.0], [2.0, 2.0]]
    assert negatives.state_dict() == []


def test_ends_lead_into_the_absorbing_state_and_the_reward_is_left_behind() -> None:
    found = Negatives(2, absorbing=True).with_newest(rollout(7, terminated=True))
    assert shown(found) == [7.0, 7.0, 0.0]
    assert found.reward is None
    assert found.absorbing is not None
    assert found.absorbing.tolist() == [False, False, True]
    recorded = Negatives(2).with_newest(replace(rollout(7, terminated=True)))
    assert recorded.absorbing is None
    assert recorded.terminated.tolist() == [False, True]


def test_it_goes_on_with_what_it_had(tmp_path: Path) -> None:
    for absorbing in (False, True):
        negatives, other = Negatives(3, absorbing), Negatives(3, absorbing)
        for i in range(4):
            negatives.with_newest(rollout(i, terminated=i % 2 == 0))
        state.save(tmp_path / str(absorbing), negatives.state_dict())
        other.load_state_dict(state.load(tmp_path / str(absorbing)), torch.device("cpu"))
        ours, theirs = (n.with_newest(rollout(9)) for n in (negatives, other))
        assert shown(ours) == shown(theirs)
        assert torch.equal(ours.terminated, theirs.terminated)
