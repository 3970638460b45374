"""The mean of several rewards: of each step, through a file, s_abs at 0, and what it refuses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from irl.core.nets import Normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.policies import shelf
from irl.policies.density import Density
from irl.rewards.artefact import load_reward, save_reward
from irl.rewards.averaged import averaged
from irl.rewards.ensemble import EnsembleNet
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.shaped import ShapedNet, ShapedSpec

SHAPED = ShapedSpec(3, 2, (8,), (8,), absorbing_scale=10.0)


def rewards(kind: str, count: int = 3) -> list[LearnedReward]:
    """Of networks with weights of their own, at steps 1 to `count`."""
    net: ShapedSpec | LogitSpec = SHAPED if kind in ("g", "f") else LogitSpec(3, 2, (8,))
    made = []
    for step in range(1, count + 1):
        normaliser, generator = Normaliser(3), torch_stream(step, "averaged")
        of = ShapedNet(net, normaliser, generator) if isinstance(net, ShapedSpec) else None
        of = of or LogitNet(net, normaliser, generator)  # pyright: ignore[reportArgumentType]
        spec = RewardSpec("Hopper-v5", "airl", kind, "obs, action", net, 0.9, 1.0, step, {})
        made.append(LearnedReward(spec, of))
    return made


def steps() -> Transitions:
    """Twelve, of which some terminate."""
    draw = torch_stream(0, "steps")
    obs, action, after = (torch.randn(12, n, generator=draw) for n in (3, 2, 3))
    terminated = torch.arange(12) % 4 == 3
    return Transitions(obs, action, after, terminated, torch.zeros(12, dtype=torch.bool))


@pytest.mark.parametrize("kind", ["g", "f", "gail", "logit"])
def test_each_step_is_paid_the_mean(kind: str, tmp_path: Path) -> None:
    given, batch = rewards(kind), steps()
    one = averaged(given)
    expected = torch.stack([reward(batch) for reward in given]).mean(0)
    torch.testing.assert_close(one(batch), expected)
    anchored = torch.stack([reward.anchored(batch) for reward in given]).mean(0)
    torch.testing.assert_close(one.anchored(batch), anchored)
    assert one.spec.env_steps == 3
    save_reward(tmp_path, one.spec, one.net)
    again = load_reward(tmp_path, kind if kind in ("g", "f") else None)
    np.testing.assert_array_equal(again(batch), one(batch))


def test_of_one_it_is_that_one() -> None:
    (given,) = rewards("g", 1)
    torch.testing.assert_close(averaged([given])(steps()), given(steps()))


def test_what_it_refuses() -> None:
    given = rewards("g")
    with pytest.raises(ValueError, match="no rewards"):
        averaged([])
    with pytest.raises(ValueError, match="of 2"):
        averaged([*given, *rewards("f", 1)])
    with pytest.raises(ValueError, match="ensemble"):
        averaged([averaged(given)])
    given[0].log_pi = Density(shelf.find("Hopper-v5").policy)
    with pytest.raises(ValueError, match="f-log-pi"):
        averaged(given)


def test_an_ensemble_is_of_the_same_networks() -> None:
    given = rewards("g")
    one = averaged(given)
    assert isinstance(one.net, EnsembleNet)
    assert one.spec == replace(given[-1].spec, net=one.net.spec)
