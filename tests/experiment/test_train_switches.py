"""Switches from the command line to a saved reward that is read and judged."""

import re
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from irl.algorithms.adversarial import ReplayedScheduleConfig
from irl.algorithms.interleaved import InterleavedConfig
from irl.core import files
from irl.core.records import open_run
from irl.core.rng import episode_seeds
from irl.core.types import Transitions, from_episodes
from irl.demos.load import load_demos
from irl.discriminators.airl import AIRLConfig
from irl.discriminators.dac import DACConfig
from irl.discriminators.gail import GAIL, GAILConfig
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollouts
from irl.experiment import build
from irl.experiment.configs import OFF_POLICY, AIRLRun, DACRun, GAILRun
from irl.learners.ppo import PPOConfig
from irl.policies.policy import load_policy
from irl.rewards.artefact import load_reward
from irl.rewards.ensemble import EnsembleNet
from tests import pointmass
from tests.experiment.conftest import DATASET, LOOK, QUICK, TASK

Command = Callable[..., None]
WORDS = ("--env-id", TASK, *QUICK, "--steps=256", "--watch.no-tensorboard")


def last(run: str) -> Path:
    return list(open_run(Path(run)).snapshots().values())[-1]


@pytest.mark.parametrize("method", ["gail", "airl"])
def test_an_ensemble_is_saved_read_and_judged(irl: Command, method: str) -> None:
    several = ("--discriminator.ensemble=3", "--discriminator.ensemble-reward=lowest")
    irl("train", method, *WORDS, *several, "--out", "run", "--watch.checkpoint-every-s=0")
    reward = load_reward("run")
    assert isinstance(reward.net, EnsembleNet)
    batch = from_episodes(load_demos(DATASET, episodes=2))
    each = torch.stack([member(batch) for member in reward._members])
    assert torch.equal(reward(batch), each.amin(0))
    assert torch.equal(reward.to("cpu")(batch), reward(batch))
    assert torch.isfinite(reward.anchored(batch)).all()
    assert files.read_json(last("run") / "reward" / "spec.json")["net"]["kind"] == "ensemble"
    before = (last("run") / "reward" / "weights.safetensors").read_bytes()
    torn = list(open_run(Path("run")).checkpoints().values())[-1] / "state.safetensors"
    torn.write_bytes(b"torn")
    irl("train", "--resume", "run")
    assert (last("run") / "reward" / "weights.safetensors").read_bytes() == before
    irl("evaluate", "run", *LOOK)


def test_whole_steps_are_judged_and_the_settings_are_written_down(irl: Command) -> None:
    more = ("--discriminator.inputs=obs_action_next_obs", "--discriminator.mixup=0.5")
    irl("train", "gail", *WORDS, *more, "--discriminator.weight-decay=0.1", "--out", "run")
    reward = load_reward("run")
    assert reward.spec.inputs == "obs, action, next obs"
    batch = from_episodes(load_demos(DATASET, episodes=1))
    other = from_episodes(load_demos(DATASET, episodes=1))
    moved = type(batch)(other.obs, other.action, other.next_obs + 1.0, other.terminated, other.truncated)
    assert not torch.allclose(reward(batch), reward(moved))
    assert files.read_json(Path("run/config.json"))["discriminator"]["mixup"] == 0.5


@pytest.mark.parametrize("scale", [0.0, 10.0])
def test_gail_sees_the_policy_in_the_absorbing_state_where_it_knows_one(
    monkeypatch: pytest.MonkeyPatch, scale: float
) -> None:
    shown: list[Transitions] = []

    def noted(self: GAIL, expert: Transitions, policy: Transitions) -> dict[str, float]:
        shown.append(policy)
        return update(self, expert, policy)

    update = GAIL.update
    monkeypatch.setattr(GAIL, "update", noted)
    learner = PPOConfig(n_envs=2, steps_per_round=128, batch_size=64, hidden=(8,))
    # a task in which it soon falls
    config = GAILRun(env_id='PointMass-v0?{"cliff":0.05}', steps=128, learner=learner)
    config = replace(config, discriminator=GAILConfig(hidden=(8,), absorbing_scale=scale))
    list(build.imitation(config, pointmass.demonstrations(2)).rounds(128))
    there = sum(int(batch.absorbing.sum()) for batch in shown if batch.absorbing is not None)
    assert (there > 0) == (scale > 0)


def test_what_is_refused_is_one_line_with_the_reason(irl: Command, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        irl("train", "airl", *WORDS, "--discriminator.loss=wasserstein", "--out", "run")
    assert "AIRL has no loss wasserstein: log pi falls out" in capsys.readouterr().err
    assert not Path("run").exists()


def test_the_scale_and_the_bound_of_rewards_reach_the_learner_and_not_the_saved_reward(irl: Command) -> None:
    off = ("--learner.reward-scaling=none", "--learner.reward-clip=0.1")
    for out, more in (("on", ()), ("off", off)):
        irl("train", "gail", *WORDS, *more, "--out", out)
    scales = [load_reward(out).spec.reward_scale for out in ("on", "off")]
    assert scales[0] != 1.0
    assert scales[1] == 1.0
    sac = "--steps=32 --learner.steps-per-round=16 --learner.learning-starts=4 --learner.batch-size=4"
    quick = "--learner.quantiles=0 --learner.hidden=8 --learner.products=float32 --watch.eval-episodes=0"
    scaled = ("--learner.reward-scaling=std", "--demo-episodes=2", "--watch.checkpoint-every-s=0")
    irl("train", "dac", "--env-id", TASK, "--out", "dac", *sac.split(), *quick.split(), *scaled)
    assert load_reward("dac").spec.reward_scale != 1.0
    before = (last("dac") / "policy.safetensors").read_bytes()
    newest = list(open_run(Path("dac")).checkpoints().values())[-1]
    (newest / "state.safetensors").write_bytes(b"torn")
    irl("train", "--resume", "dac")
    assert (last("dac") / "policy.safetensors").read_bytes() == before


def test_a_bound_that_would_pay_dying_is_refused() -> None:
    clipped = PPOConfig(reward_clip=10.0)
    for make_run in (
        lambda: AIRLRun(TASK, learner=clipped),
        lambda: GAILRun(TASK, learner=clipped, discriminator=GAILConfig(absorbing_scale=10.0)),
    ):
        with pytest.raises(ValueError, match="would cut off what the absorbing state pays"):
            make_run()
    GAILRun(TASK, learner=clipped)
    AIRLRun(TASK, learner=clipped, discriminator=AIRLConfig(terminal="mask"))
    DACRun(TASK, learner=replace(OFF_POLICY, reward_clip=10.0))


def test_observations_are_normalised_by_random_actions_too_where_it_is_asked_for(irl: Command) -> None:
    for name in ("expert", "mixed"):
        irl("train", "gail", *WORDS, f"--normaliser={name}", "--seed=3", "--out", name)
    own, both = (load_reward(name).net.normaliser for name in ("expert", "mixed"))
    batch = from_episodes(load_demos(DATASET, episodes=4, seed=3))
    torch.testing.assert_close(own.mean, batch.obs.mean(0))
    # the middle of the two: what random actions see is as far on the other side
    random, space = both.mean * 2 - own.mean, make(TASK).action_space
    seeds = episode_seeds(0, "of the test", 200)
    played = from_episodes(rollouts(TASK, random_act(space, np.random.default_rng(0)), seeds)).obs
    assert ((random - played.mean(0)).abs() < 0.5 * played.std(0)).all()
    spread = (own.var + played.var(0)) / 2 + (own.mean - both.mean).square()
    torch.testing.assert_close(both.var, spread, rtol=0.5, atol=1e-3)
    # the policy sees what D sees
    weights = load_policy(last("mixed") / "policy.safetensors").weights
    np.testing.assert_allclose(weights["obs_mean"], both.mean.numpy())
    before = (last("mixed") / "policy.safetensors").read_bytes()
    irl("train", "--config", "mixed/config.json", "--out", "again")
    assert (last("again") / "policy.safetensors").read_bytes() == before


def test_every_switch_is_in_the_table_with_its_source() -> None:
    """Sizes and rates are no switches: every paper has its own."""
    sizes = {"hidden", "potential_hidden", "lr", "batch_size", "epochs", "every"}
    table = (Path(__file__).parents[2] / "scripts" / "benchmarks" / "SWITCHES.md").read_text(encoding="utf-8")
    configs = (GAILConfig, DACConfig, AIRLConfig, ReplayedScheduleConfig, InterleavedConfig)
    names = {field.name for config in configs for field in fields(config)} - sizes
    lines = [line for line in table.split("## What each")[0].splitlines() if line.startswith("|")][2:]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    # name, default, methods, source, why the default
    assert [row[0] for row in rows if len(row) != 5 or not all(row)] == []
    listed = [
        word for row in rows for code in re.findall(r"`([^`]*)`", row[0]) for word in re.split(r"[. ]", code)
    ]
    assert [name for name in sorted(names) if name.replace("_", "-") not in listed] == []
