"""The probe: equal parts, whole episodes, the same every time, and rewards read as they were learned."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from irl.algorithms.probe import STRATA, probe, random_episodes, read
from irl.core.nets import Normaliser
from irl.core.types import Transitions, from_episodes
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.mujoco import HandWritten
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.shaped import ShapedNet, ShapedSpec
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


LOGIT = LogitSpec(3, 2, (16,), "tanh", absorbing_scale=10.0)
SHAPED = ShapedSpec(3, 2, (16,), (16,), "tanh", absorbing_scale=10.0)


@pytest.mark.parametrize(
    ("spec", "paid"),
    [
        (LOGIT, "logit"),
        (replace(LOGIT, sees="obs_next_obs"), "logit"),
        (SHAPED, "g"),
        (SHAPED, "f"),
        (replace(SHAPED, absorbing_scale=0.0), "f"),
    ],
    ids=["(s, a)", "(s, s')", "g", "f", "f with h masked"],
)
def test_a_terminal_step_is_read_as_it_was_learned(spec: LogitSpec | ShapedSpec, paid: str) -> None:
    """Up to one constant it is the reward with the absorbing state at 0, at terminations and elsewhere."""
    rng = torch.Generator().manual_seed(0)
    obs, after, action = (torch.randn(6, size, generator=rng) for size in (3, 3, 2))
    ended = torch.tensor([False, False, False, False, True, True])
    batch = Transitions(obs, action, after, ended, torch.zeros_like(ended))
    net = (LogitNet if isinstance(spec, LogitSpec) else ShapedNet)(spec, Normaliser(3), rng)  # pyright: ignore[reportArgumentType]
    reward = LearnedReward(RewardSpec("A-v1", "airl", paid, "", spec, 0.99, 1.0, 0, {}), net)
    of_absorbing = torch.from_numpy(read(reward, batch)) - reward.anchored(batch)
    assert float(of_absorbing.max() - of_absorbing.min()) < 1e-5


def test_of_the_hand_written_reward_a_termination_is_as_recorded() -> None:
    batch = from_episodes(random_episodes("Cliff-v0", 100, seed=0))
    assert batch.terminated.any()
    assert batch.reward is not None
    np.testing.assert_array_equal(read(HandWritten(), batch), batch.reward.double().numpy())
