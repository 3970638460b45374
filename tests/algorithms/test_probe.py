"""The probe: equal parts, whole episodes, the same every time."""

import torch

from irl.algorithms.probe import STRATA, probe, random_episodes
from irl.core.types import from_episodes
from tests import pointmass


def test_every_stratum_has_the_same_number_of_steps_from_its_own_episodes() -> None:
    expert, policy = pointmass.demonstrations(5), pointmass.demonstrations(2)
    made = probe(expert, policy, "PointMass-v0", seed=0)
    assert list(made.steps) == list(STRATA)
    assert {len(steps) for steps in made.steps.values()} == {2 * pointmass.STEPS}
    every = {tuple(row) for row in from_episodes(expert).obs.tolist()}
    drawn = [tuple(row) for row in made.steps["expert"].obs.tolist()]
    assert set(drawn) <= every
    assert len(set(drawn)) == len(drawn)


def test_the_same_seed_probes_the_same_steps_and_another_one_others() -> None:
    expert = pointmass.demonstrations(3)
    probes = [probe(expert, expert, "PointMass-v0", seed) for seed in (0, 0, 1)]
    randoms = [made.steps["random"].obs for made in probes]
    assert torch.equal(randoms[0], randoms[1])
    assert not torch.equal(randoms[0], randoms[2])


def test_random_episodes_are_whole_and_enough() -> None:
    episodes = random_episodes("Cliff-v0", 300, seed=0)
    assert sum(map(len, episodes)) >= 300
    assert all(episode.terminated or episode.truncated for episode in episodes)


def test_a_small_probe_still_has_its_random_episodes() -> None:
    assert len(random_episodes("PointMass-v0", 3, seed=0)) == 20
