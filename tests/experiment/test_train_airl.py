"""AIRL from the command line: the promises of every method, and those of a reward that has parts."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

import irl as package
from irl.algorithms.adversarial import Adversarial
from irl.core import files
from irl.core.records import open_run
from irl.core.types import from_episodes
from irl.discriminators.airl import AIRL, AIRLConfig
from irl.experiment import build
from irl.experiment.configs import AIRLRun, AIRLSACRun
from irl.experiment.snapshots import every_snapshot
from irl.learners.ppo import PPOConfig, PPOLearner
from tests import pointmass
from tests.experiment.conftest import LOOK, QUICK, TASK
from tests.experiment.test_train_dac import SMALL, same

Command = Callable[..., None]
Train = Callable[..., Path]

PPO = [*QUICK, "--schedule.warmup-rounds=2", "--schedule.warmup-epochs=2", "--schedule.negatives=3"]
WORDS = {"airl": PPO, "airl-sac": SMALL}


@pytest.fixture
def learn(irl: Command) -> Train:
    def run(method: str, out: str, *more: str, env_id: str = TASK) -> Path:
        irl("train", method, "--env-id", env_id, "--out", out, *WORDS[method], *more)
        return Path(out)

    return run


@pytest.mark.parametrize("method", WORDS)
def test_the_same_seed_is_the_same_run_watched_or_not(method: str, learn: Train, irl: Command) -> None:
    unwatched = ("--watch.eval-every=0", "--watch.eval-episodes=0", "--watch.no-tensorboard")
    first = learn(method, "first")
    assert same(first, learn(method, "again", *unwatched))
    assert not same(first, learn(method, "other", "--seed=1"))
    irl("train", "--config", first / "config.json", "--out", "by config")
    irl("train", "--resume", first)
    assert same(first, Path("by config"))


def test_the_tasks_own_reward_replaced_by_nan_changes_no_weight(learn: Train) -> None:
    more = ("--demos=irl/pointmass/expert-v0",)
    assert same(learn("airl", "plain", *more), learn("airl", "nan", *more, env_id="NaNReward-v0"))


def test_the_reward_of_a_run_is_g_unless_f_is_asked_for(learn: Train, irl: Command) -> None:
    run = learn("airl", "run", "--discriminator.inputs=obs")
    irl("evaluate", run, *LOOK)
    assert json.loads((run / "evaluation.json").read_text())["method"] == "airl"
    g, f = package.load_reward(run), package.load_reward(run, "f")
    assert (g.spec.reward_map, f.spec.reward_map, g.spec.inputs) == ("g", "f", "obs")
    steps = from_episodes(pointmass.demonstrations(1))
    assert torch.equal(g(steps), package.load_reward(run, "g")(steps))
    h = f.net.h(steps)  # pyright: ignore[reportCallIssue]
    # along an episode, the next step's potential is this one's h(s')
    torch.testing.assert_close((f(steps) - g(steps))[:-1], 0.99 * h[1:] - h[:-1], atol=1e-5, rtol=1e-4)
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    assert {"airl/log_pi_expert", "airl/log_pi_policy", "airl/log_pi_at_bound"} <= set(rows[0])


def test_a_part_is_judged_beside_the_whole_reward_and_leaves_its_report_alone(
    learn: Train, train: Train, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    run = learn("airl", "run")
    irl("evaluate", run, *LOOK)
    before = {file: file.read_bytes() for file in run.rglob("*") if file.is_file()}
    irl("evaluate", run, *LOOK, "--part=f")
    irl("evaluate", run, *LOOK, "--part=g")
    assert before == {file: file.read_bytes() for file in before}
    whole, f, g = (json.loads((run / f"evaluation{name}.json").read_text()) for name in ("", "-f", "-g"))
    assert (whole["ledger"]["kind"], f["ledger"]["kind"], f["part"], g["part"]) == ("g", "f", "f", "g")
    assert g["reward"] == whole["reward"]
    assert f["reward"]["strata"] != whole["reward"]["strata"]
    of_gail = train("gail")
    with pytest.raises(SystemExit):
        irl("evaluate", of_gail, *LOOK, "--part=f")
    assert "only AIRL's rewards have; leave it out" in capfd.readouterr().err
    assert not (of_gail / "evaluation-f.json").exists()


def test_the_average_of_the_snapshots_so_far_is_judged(
    learn: Train, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    run = learn("airl", "run")
    steps = from_episodes(pointmass.demonstrations(1))
    there = open_run(run).snapshots()
    rewards = {at: package.load_reward(path) for at, path in there.items()}
    _, means = every_snapshot(TASK, there, None, average=True)
    first, second = list(rewards)[1:3]
    torch.testing.assert_close(means[0](steps), rewards[0](steps))
    torch.testing.assert_close(means[first](steps), rewards[first](steps))
    torch.testing.assert_close(means[second](steps), (rewards[first](steps) + rewards[second](steps)) / 2)
    of_the_run = package.load_reward(run, average=True)
    torch.testing.assert_close(of_the_run(steps), means[max(rewards)](steps))
    with pytest.raises(package.UserError, match="no rewards to average in"):
        package.load_reward(run / "snapshots", average=True)
    irl("evaluate", run, *LOOK)
    before = {file: file.read_bytes() for file in run.rglob("*") if file.is_file()}
    irl("evaluate", run, *LOOK, "--average", "--part=f")
    irl("evaluate", run, *LOOK, "--average")
    assert before == {file: file.read_bytes() for file in before}
    names = ("evaluation", "evaluation-average", "evaluation-average-f")
    last, mean, mean_of_f = (json.loads((run / f"{name}.json").read_text()) for name in names)
    assert (last["average"], mean["average"], mean_of_f["part"]) == (False, True, "f")
    assert mean["drift"]["to_truth"][:2] == last["drift"]["to_truth"][:2]
    assert mean["reward"]["strata"] != last["reward"]["strata"] != mean_of_f["reward"]["strata"]
    with pytest.raises(SystemExit):
        irl("evaluate", run, *LOOK, "--average", "--part=f-log-pi")
    assert "not averaged; choose g or f" in capfd.readouterr().err


def test_a_policy_is_retrained_on_each_part_and_goes_on_with_the_one_it_was_begun_with(
    learn: Train, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    learn("airl", "run")
    small = ("--ppo.n-envs=2", "--ppo.steps-per-round=128", "--ppo.batch-size=64", "--steps=256")
    for part in ("g", "f", "f-log-pi"):
        irl("retrain", "run", "--part", part, *small, "--watch.no-progress")
        folder = Path(f"runs/retrain-run-768-{part}-ppo-s1000")
        assert files.read_json(folder / "retrain.json")["reward"]["reward_map"] == part
        irl("retrain", "--resume", folder)
        assert files.read_json(folder / "reward.json")["reward_map"] == part
    irl("train", "gail", "--env-id", TASK, "--out", "gail", *QUICK)
    with pytest.raises(SystemExit):
        irl("retrain", "gail", "--part=f", *small)
    assert "only AIRL's rewards have; leave it out" in capfd.readouterr().err


def test_a_reward_is_taken_to_the_task_under_other_dynamics_and_to_no_other_task(
    learn: Train, irl: Command, capfd: pytest.CaptureFixture
) -> None:
    learn("airl", "run")
    small = ("--ppo.n-envs=2", "--ppo.steps-per-round=128", "--ppo.batch-size=64", "--steps=256")
    irl("retrain", "run", "--env-kwargs", "cliff=0.7", "--out", "there", *small, "--watch.no-progress")
    result = files.read_json(Path("there/retrain.json"))
    assert result["env_id"] == 'PointMass-v0?{"cliff":0.7}'
    assert min(result["true"]["lengths"]) < pointmass.STEPS  # it ends early there
    irl("retrain", "--resume", "there")
    with pytest.raises(SystemExit):
        irl("retrain", "run", "--env-kwargs", "height=2", "--out", "nowhere", *small)
    assert "height" in capfd.readouterr().err
    config = files.read_json(Path("there/config.json"))
    files.write_json(Path("there/config.json"), config | {"env_id": "Cliff-v0"})
    with pytest.raises(SystemExit):
        irl("retrain", "--resume", "there")
    assert "is of PointMass-v0" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("method", "words", "remedy"),
    [
        ("airl", ("--learner.ent-coef=0.1",), "--discriminator.reward f"),
        ("airl-sac", ("--discriminator.reward=f-log-pi",), "use --discriminator.reward f"),
    ],
)
def test_entropy_is_not_paid_twice(method, words, remedy, learn: Train, capfd: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as stopped:
        learn(method, "run", *words)
    assert stopped.value.code == 2
    said = capfd.readouterr().err
    assert "entropy would be paid twice" in said
    assert remedy in said
    assert said.count("\n") == 1
    assert not Path("run").exists()


def test_with_an_entropy_bonus_the_learner_is_paid_f(learn: Train) -> None:
    learn("airl", "run", "--learner.ent-coef=0.1", "--discriminator.reward=f")
    assert AIRLRun(TASK).learner.ent_coef == 0.0
    assert AIRLRun(TASK).discriminator.reward == "f-log-pi"
    assert AIRLSACRun(TASK).discriminator.reward == "f"


def made(steps: int = 128) -> Adversarial:
    learner = PPOConfig(
        n_envs=2, steps_per_round=steps, batch_size=64, n_epochs=2, gamma=0.8, log_std_init=1.0
    )
    discriminator = AIRLConfig(log_pi_bound=10.0)
    algorithm = build.imitation(
        AIRLRun("Cliff-v0", learner=learner, discriminator=discriminator), pointmass.demonstrations(4)
    )
    assert isinstance(algorithm, Adversarial)
    return algorithm


def test_the_discount_of_the_shaping_is_the_learners_own() -> None:
    algorithm = made()
    assert isinstance(algorithm.discriminator, AIRL)
    assert isinstance(algorithm.learner, PPOLearner)
    assert algorithm.discriminator.gamma == algorithm.learner.model.gamma == 0.8
    steps = from_episodes(pointmass.demonstrations(1))
    net = algorithm.discriminator.net
    with torch.no_grad():
        shaping = net.f(steps, algorithm.discriminator.gamma) - net.g(steps)
        logits = algorithm.discriminator.logits(steps) + algorithm.discriminator.log_pi(steps)
        torch.testing.assert_close(logits - net.g(steps), shaping, atol=1e-5, rtol=1e-4)
        torch.testing.assert_close(
            shaping[:-1], 0.8 * net.h(steps)[1:] - net.h(steps)[:-1], atol=1e-5, rtol=1e-4
        )


def test_log_pi_is_of_the_learner_as_it_is_when_asked() -> None:
    algorithm = made()
    discriminator, learner = algorithm.discriminator, algorithm.learner
    assert isinstance(discriminator, AIRL)
    batch = learner.collect()
    before = discriminator.log_pi(batch)
    torch.testing.assert_close(before, learner.log_pi(batch).clamp(-10, 10))
    learner.improve(discriminator.reward)
    after = discriminator.log_pi(batch)
    assert not torch.equal(before, after)
    torch.testing.assert_close(after, learner.log_pi(batch).clamp(-10, 10))


def test_the_discriminator_is_shown_the_absorbing_state_and_the_learner_only_paid_for_it() -> None:
    # long enough to fall off
    algorithm = made(1024)
    seen, update = [], algorithm.discriminator.update
    algorithm.discriminator.update = lambda expert, policy: (seen.append(policy), update(expert, policy))[1]
    next(algorithm.rounds(1))
    assert any(bool(batch.absorbing.any()) for batch in seen)
    assert not any(bool(batch.terminated.any()) for batch in seen)
    assert np.isfinite(algorithm.learner.reward_scale)
