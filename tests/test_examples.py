"""The examples in scripts/examples run, and the second one learns."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch

from irl.core.types import from_episodes
from irl.envs.rollouts import rollouts
from irl.learners.ppo import PPOConfig
from tests import pointmass

EXAMPLES = Path(__file__).parents[1] / "scripts" / "examples"


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("steps", "episodes", "least"), [(2048, 3, 1.0), pytest.param(16_384, 6, 475.0, marks=pytest.mark.slow)]
)
def test_your_demonstrations(steps, episodes, least, tmp_path, capsys) -> None:
    module = example("your_demonstrations")
    assert module.run(module.Example(tmp_path, steps=steps, episodes=episodes)) >= least
    assert (tmp_path / "run" / "report.html").is_file()


def test_a_new_method_learns_the_point_mass() -> None:
    module = example("new_method")
    steps = 12_288
    config = PPOConfig(n_envs=8, steps_per_round=512, batch_size=128, n_epochs=10, lr=3e-3, hidden=(32,))
    expert = from_episodes(pointmass.demonstrations(4))
    algorithm = module.build("PointMass-v0", expert, steps, 0, config)
    before = rollouts("PointMass-v0", algorithm.learner.policy(), range(5))
    list(algorithm.rounds(steps))
    after = rollouts("PointMass-v0", algorithm.learner.policy(), range(5))
    algorithm.learner.close()
    known = rollouts("PointMass-v0", pointmass.expert(), range(5))
    best, first, last = (np.mean([e.return_ for e in played]) for played in (known, before, after))
    assert best - last < 0.3 * (best - first)
    assert torch.isfinite(algorithm.discriminator.reward(expert)).all()


def test_the_new_method_is_60_lines() -> None:
    source = (EXAMPLES / "new_method.py").read_text()
    method = source[source.index("class LeastSquares") : source.index("def main")]
    assert len([line for line in method.splitlines() if line.strip()]) <= 60
