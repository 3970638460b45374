"""Terms of real rewards: the hand-written one is made of its own terms."""

import numpy as np
import pytest

from irl.algorithms.probe_set import ProbeSet
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollouts
from irl.experiment.attributed import judge_terms
from irl.policies import shelf
from irl.rewards.mujoco import HandWritten
from tests import pointmass


@pytest.fixture(scope="module")
def probe() -> ProbeSet:
    env = make("Hopper-v5")
    random = rollouts("Hopper-v5", random_act(env.action_space, np.random.default_rng(0)), list(range(20)))
    env.close()
    expert = rollouts("Hopper-v5", shelf.find("Hopper-v5").policy, [1])
    return ProbeSet("Hopper-v5", {"expert": tuple(expert), "random": tuple(random)})


def test_the_hand_written_reward_weighs_each_of_its_terms_once(probe: ProbeSet) -> None:
    found = judge_terms(HandWritten(), probe, 0.99, 0)
    assert found["reason"] is None
    assert found["explained"] == pytest.approx(1.0, abs=1e-4)
    forward = found["weights"]["forward"]
    assert forward["why_not"] is None
    assert forward["weight"] == pytest.approx(1.0, abs=1e-3)
    assert forward["relative"] == pytest.approx(1.0)
    assert found["survival_bonus"] == pytest.approx(1.0, abs=1e-2)
    # worth a millionth of what moves the reward
    assert "of the hand-written reward's variance here" in found["weights"]["ctrl"]["why_not"]


def test_where_no_terms_were_recorded_it_says_so() -> None:
    base = ProbeSet("PointMass-v0", {"expert": tuple(pointmass.demonstrations(3))})
    found = judge_terms(HandWritten(), base, 0.99, 0)
    assert found == {"reason": "these episodes have no term of the hand-written reward in common"}


def test_intervals_are_of_episodes_drawn_within_their_kind_of_play(probe: ProbeSet) -> None:
    """With one episode, many times, in each kind there is nothing to draw."""
    kinds = {name: (episodes[0],) * 5 for name, episodes in probe.items()}
    found = judge_terms(lambda batch: batch.obs[:, 5] ** 2, ProbeSet("Hopper-v5", kinds), 0.99, 0)
    forward = found["weights"]["forward"]
    assert forward["low"] == pytest.approx(forward["high"], rel=1e-6)
