"""The rollouts that a discriminator is shown: which, in which order, and across a checkpoint."""

from dataclasses import replace
from pathlib import Path

import torch

from irl.algorithms.negatives import Negatives
from irl.core import state
from irl.core.rng import torch_stream
from irl.core.types import Transitions


def rollout(number: int, terminated: bool = False, steps: int = 2) -> Transitions:
    flags = torch.tensor([False] * (steps - 1) + [terminated])
    obs = torch.full((steps, 1), float(number))
    return Transitions(obs, obs, obs, flags, ~flags, reward=torch.ones(steps, dtype=torch.float64))


def of(rollouts: int, memory: int = 0, absorbing: bool = False, seed: int = 0) -> Negatives:
    return Negatives(rollouts, torch_stream(seed, "minibatches"), memory=memory, absorbing=absorbing)


def shown(of: Transitions) -> list[float]:
    return of.obs[:, 0].tolist()


def test_the_last_three_are_shown_oldest_first() -> None:
    negatives = of(3)
    found = [shown(negatives.with_newest(rollout(i))) for i in range(1, 6)]
    assert found[0] == [1.0, 1.0]
    assert found[1] == [1.0, 1.0, 2.0, 2.0]
    assert found[2] == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert found[3] == [2.0, 2.0, 3.0, 3.0, 4.0, 4.0]
    assert found[4] == [3.0, 3.0, 4.0, 4.0, 5.0, 5.0]


def test_of_one_only_the_newest_is_and_nothing_is_kept() -> None:
    negatives = of(1)
    assert [shown(negatives.with_newest(rollout(i))) for i in (1, 2)] == [[1.0, 1.0], [2.0, 2.0]]
    assert negatives.state_dict()["before"] == negatives.state_dict()["older"] == []


def test_ends_lead_into_the_absorbing_state_and_the_reward_is_left_behind() -> None:
    found = of(2, absorbing=True).with_newest(rollout(7, terminated=True))
    assert shown(found) == [7.0, 7.0, 0.0]
    assert found.reward is None
    assert found.absorbing is not None
    assert found.absorbing.tolist() == [False, False, True]
    recorded = of(2).with_newest(replace(rollout(7, terminated=True)))
    assert recorded.absorbing is None
    assert recorded.terminated.tolist() == [False, True]


def test_what_leaves_the_newest_is_remembered_in_the_order_it_came_until_the_memory_is_full() -> None:
    negatives = of(2, memory=5)
    found = [shown(negatives.with_newest(rollout(i))) for i in range(1, 8)]
    assert found[3] == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0]
    for i, seen in enumerate(found[4:], 5):
        assert seen[5:] == [i - 1.0, i - 1.0, float(i), float(i)]
        assert seen[:5] == sorted(seen[:5])
        assert max(seen[:5]) <= i - 2
    at_once = of(1, memory=3)
    assert [shown(at_once.with_newest(rollout(i))) for i in (1, 2)] == [[1.0, 1.0], [1.0, 1.0, 2.0, 2.0]]


def test_the_memory_is_a_uniform_sample_of_all_that_left() -> None:
    # 24 of 240 steps stay: of each of the 12 rollouts 2 are expected in each of the 60 draws, hypergeometric
    seeds, rollouts, steps, memory = 60, 12, 20, 24
    times = torch.zeros(rollouts + 1)
    for seed in range(seeds):
        negatives = of(1, memory=memory, seed=seed)
        for i in range(rollouts):
            negatives.with_newest(rollout(i, steps=steps))
        last = negatives.with_newest(rollout(rollouts, steps=steps))
        times += torch.bincount(last.obs[:memory, 0].long(), minlength=rollouts + 1)
    n, share = rollouts * steps, 1 / rollouts
    variance = seeds * memory * share * (1 - share) * (n - memory) / (n - 1)
    assert times[rollouts] == 0
    assert torch.all((times[:rollouts] - seeds * memory * share).abs() < 4.0 * variance**0.5)


def test_it_goes_on_with_what_it_had(tmp_path: Path) -> None:
    for absorbing, memory in ((False, 0), (True, 0), (True, 3)):
        negatives, other = of(3, memory, absorbing), of(3, memory, absorbing)
        for i in range(9):
            negatives.with_newest(rollout(i, terminated=i % 2 == 0))
        place = tmp_path / f"{absorbing} {memory}"
        state.save(place, negatives.state_dict())
        other.load_state_dict(state.load(place), torch.device("cpu"))
        other._rng.set_state(negatives._rng.get_state())
        for i in (9, 10, 11):
            ours, theirs = (n.with_newest(rollout(i)) for n in (negatives, other))
            assert shown(ours) == shown(theirs)
            assert torch.equal(ours.terminated, theirs.terminated)
