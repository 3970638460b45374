"""What the default distance must see on MuJoCo, and one that knows x may not: which way to run."""

import numpy as np
import pytest

from irl.algorithms.probe_make import base_probe
from irl.core.types import Transitions, from_episodes
from irl.diagnostics.diagnose import diagnose
from irl.policies import shelf
from irl.rewards.mujoco import HandWritten
from irl.rewards.velocity import FORMS, of_task

TASK = "HalfCheetah-v5"


@pytest.fixture(scope="module")
def probe():
    return base_probe(TASK, shelf.find(TASK).policy, steps=1000)


def backwards(batch: Transitions):
    return batch.terms["ctrl"] - batch.terms["forward"]


def test_running_backwards_is_far_and_the_same_reward_by_velocity_near(probe) -> None:
    assert diagnose(backwards, HandWritten(), probe).headline.value > 0.7
    near = diagnose(of_task(TASK), HandWritten(), probe)
    assert near.headline.value < 0.05
    assert near.headline.n == 50
    assert near.headline.shown == "not distinguishable"


@pytest.mark.parametrize("env_id", ["HalfCheetah-v5", "Hopper-v5"])
def test_the_form_in_velocities_is_the_reward_up_to_the_displacement(env_id: str, probe) -> None:
    if env_id != TASK:
        probe = base_probe(env_id, shelf.find(env_id).policy, steps=300)
    batch = from_episodes([episode for episodes in probe.values() for episode in episodes])
    others = sum(values for name, values in batch.terms.items() if name != "forward")
    forward, recorded = (of_task(env_id)(batch) - others).numpy(), batch.terms["forward"].numpy()
    assert np.std(forward - recorded) < 0.06 * np.std(recorded)
    assert set(FORMS) >= {"Hopper-v5", "HalfCheetah-v5", "Walker2d-v5"}
