"""A shelf, a dataset and a short run of the point mass, made once."""

from collections.abc import Callable
from pathlib import Path

import pytest

from irl.core.rng import episode_seeds
from irl.demos.generate import generate
from irl.experiment.cli import main
from irl.policies import shelf
from irl.policies.card import Card, measure, measure_random
from tests import pointmass

TASK = "PointMass-v0"
DATASET = "irl/pointmass/expert-v0"
SETTINGS = {
    "steps": 768,
    "learner.n-envs": 2,
    "learner.steps-per-round": 128,
    "learner.batch-size": 64,
    "learner.n-epochs": 2,
    "learner.hidden": 16,
    "discriminator.hidden": 16,
    "schedule.batch-size": 64,
    "schedule.epochs": 1,
    "watch.eval-every": 2,
    "watch.eval-episodes": 2,
}
LOOK = ("--episodes=2", "--probe-steps=90", "--frames=6")
"""For `irl evaluate`: enough to hold every part of it."""
QUICK = [f"--{name}={value}" for name, value in SETTINGS.items()] + ["--watch.no-progress"]


@pytest.fixture(scope="session")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with `policies` and `datasets` of the point mass."""
    folder = tmp_path_factory.mktemp("home")
    policy, random = pointmass.expert(), measure_random(TASK)
    measured = measure(TASK, policy, episode_seeds(0, "card", 20))
    card = Card(
        env_id=TASK,
        level="expert",
        algorithm="by hand",
        steps=0,
        seed=0,
        measured=measured,
        random_return_mean=random.return_mean,
        random_return_std=random.return_std,
        settings={},
        versions={},
        command="",
    )
    shelf.write(folder / "policies" / "pointmass" / "expert", policy, card)
    for env_id, name in ((TASK, DATASET), ("NoReward-v0", "irl/noreward/expert-v0")):
        generate(
            env_id,
            policy,
            dataset_id=name,
            root=folder / "datasets",
            seeds=range(6),
            algorithm="by hand",
            author="tests",
            random_return=random.return_mean,
            expert_return=measured.return_mean,
            description="",
        )
    return folder


@pytest.fixture
def irl(home: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., None]:
    """The command line, in an empty folder, with that shelf and those datasets."""
    monkeypatch.setenv("IRL_POLICIES_PATH", str(home / "policies"))
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(home / "datasets"))
    monkeypatch.chdir(tmp_path)
    return lambda *words: main([str(word) for word in words])


@pytest.fixture
def train(irl: Callable[..., None]) -> Callable[..., Path]:
    """Train GAIL briefly on the point mass; the run folder."""

    def run(out: str, *more: str) -> Path:
        irl("train", "gail", "--env-id", TASK, "--out", out, *QUICK, *more)
        return Path(out)

    return run
