"""DAC and GAIL with SAC from the command line: the same promises as GAIL with PPO."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file
from stable_baselines3 import TD3

import irl as package
from irl.core import files
from irl.policies.policy import load_policy
from tests.experiment.conftest import LOOK, TASK

Command = Callable[..., None]

SETTINGS = {
    "steps": 700,
    "learner.steps-per-round": 100,
    "learner.learning-starts": 150,
    "learner.updates-per-step": 0.2,
    "learner.batch-size": 32,
    "learner.hidden": 16,
    "discriminator.hidden": 16,
    "watch.eval-every": 2,
    "watch.eval-episodes": 2,
}
SMALL = [f"--{name}={value}" for name, value in SETTINGS.items()] + ["--watch.no-progress"]


RETRAINED = ["--steps=300", "--td3.steps-per-round=100", "--td3.learning-starts=150", "--td3.hidden=16"]
RETRAINED += ["--watch.no-progress", "--watch.eval-episodes=2"]


@pytest.fixture
def train(irl: Command) -> Callable[..., Path]:
    def run(method: str, out: str, *more: str, env_id: str = TASK) -> Path:
        irl("train", method, "--env-id", env_id, "--out", out, *SMALL, *more)
        return Path(out)

    return run


Train = Callable[..., Path]


def ends(run: Path) -> list[np.ndarray]:
    """The last policy's weights and the last reward's."""
    last = sorted((run / "snapshots").iterdir())[-1]
    files_ = sorted(last.rglob("*.safetensors"))
    return [weights for path in files_ for _, weights in sorted(load_file(path).items())]


def same(a: Path, b: Path) -> bool:
    return all(np.array_equal(x, y) for x, y in zip(ends(a), ends(b), strict=True))


@pytest.mark.parametrize("method", ["dac", "gail-sac", "dac-td3"])
def test_the_same_seed_is_the_same_run_watched_or_not(method: str, train: Train) -> None:
    unwatched = ("--watch.eval-every=0", "--watch.eval-episodes=0", "--watch.no-tensorboard")
    first, again = train(method, "first"), train(method, "again", *unwatched)
    assert same(first, again)
    assert not same(first, train(method, "other", "--seed=1"))


def test_config_json_repeats_the_run_and_resuming_a_finished_one_changes_nothing(
    train: Train, irl: Command
) -> None:
    first = train("dac", "first", "--demo-rate=5")
    assert files.read_json(first / "config.json")["kind"] == "dac"
    irl("train", "--config", first / "config.json", "--out", "again")
    irl("train", "--resume", first)
    assert same(first, Path("again"))


def test_the_tasks_own_reward_replaced_by_nan_changes_no_weight(train: Train) -> None:
    more = ("--demos=irl/pointmass/expert-v0",)
    assert same(train("dac", "plain", *more), train("dac", "nan", *more, env_id="NaNReward-v0"))


def test_a_run_is_evaluated_and_its_reward_and_policy_can_be_used(train: Train, irl: Command) -> None:
    run = train("dac", "run")
    irl("evaluate", run, *LOOK)
    assert json.loads((run / "evaluation.json").read_text())["method"] == "dac"
    reward = package.load_reward(run)
    assert (reward.spec.reward_map, reward.spec.net.absorbing_scale) == ("logit", 10.0)
    policy = load_policy(run / "snapshots" / "000000700" / "policy.safetensors")
    assert np.abs(policy(np.zeros(2))).max() <= 1.0
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    assert "discriminator/loss" not in rows[0]
    assert {"discriminator/loss", "discriminator/accuracy_expert", "sac/critic_loss"} <= set(rows[-1])


def test_td3_goes_on_from_a_cloned_policy_and_is_exported(train: Train, irl: Command) -> None:
    run = train("gail-td3", "run", "--warm-start.updates=20")
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    assert {"td3/actor_loss", "td3/critic_loss"} <= set(rows[-1])
    policy = load_policy(run / "snapshots" / "000000700" / "policy.safetensors")
    irl("export", run, "--out", "policy.zip")
    obs = np.array([0.5, -0.5])
    predicted, _ = TD3.load("policy.zip", device="cpu").predict(obs, deterministic=True)
    np.testing.assert_allclose(policy(obs), predicted, atol=1e-5)
    irl("retrain", run, "--algo=td3", "--out", "again", *RETRAINED)
    assert files.read_json(Path("again/retrain.json"))["algorithm"] == "td3"
