"""`irl probe`, and what `irl evaluate` reads on a probe."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from irl.algorithms.probe_file import load_probe, save_probe
from irl.algorithms.probe_make import at_shares
from irl.algorithms.probe_set import ProbeSet
from irl.core import files
from irl.core.nets import Normaliser
from irl.core.records import open_run
from irl.core.types import from_episodes
from irl.demos.load import Demos
from irl.discriminators.gail import GAILConfig
from irl.envs.rollouts import rollouts
from irl.experiment import build
from irl.experiment.configs import AIRLRun, AIRLSACRun, GAILRun
from irl.experiment.logits import Snapshot
from irl.experiment.probed import _learned_from
from irl.learners.ppo import PPOConfig
from irl.policies.density import Density
from irl.policies.policy import load_policy
from irl.rewards.artefact import load_reward
from tests import pointmass
from tests.experiment.conftest import LOOK, QUICK, TASK

Command = Callable[..., None]


def test_the_probe_of_a_run_has_the_base_of_its_task(
    train: Callable[..., Path], irl: Command, capsys: pytest.CaptureFixture
) -> None:
    run = train("run")
    capsys.readouterr()
    irl("probe", "--env-id", TASK, "--steps=60", "--out=base.npz")
    assert "no medium policy is shelved" in (said := capsys.readouterr().out)
    irl("probe", run, "--steps=60")
    base, own = load_probe("base.npz"), load_probe(run / "probe.npz")
    assert base.base_sha256[:16] in said
    assert own.base_sha256 == base.base_sha256
    shares = at_shares(list(open_run(run).snapshots()))
    assert [name for name in own if name not in base] == [f"policy at {share} %" for share in shares]
    assert {0, 100} <= set(shares)


def test_distances_and_drift_of_a_run(train: Callable[..., Path], irl: Command, capsys) -> None:
    run = train("run")
    irl("evaluate", run, *LOOK, "--also", "pearson", "npec")
    found = files.read_json(run / "evaluation.json")
    distances, drift = found["distances"], found["drift"]
    assert [d["n"] for d in distances["curve"]] == [1, 10, 50, 100, 0]
    assert "fit into 0 of" in distances["curve"][2]["reason"]
    assert [d["name"] for d in distances["references"]] == ["pearson", "npec"]
    assert distances["headline"] == distances["curve"][1]
    assert {"expert", "medium", "policy at 0 %", "policy at 100 %"} <= set(distances["strata"])
    n = len(drift["snapshots"])
    for per_snapshot in ("to_truth", "to_final", "health", "hygiene", "outside", "sign_agreement"):
        assert len(drift[per_snapshot]) == n
    for between in ("speed", "shift", "sign_flips", "moves"):
        assert len(drift[between]) == n - 1
    for moved in (*drift["moves"], *drift["parts"]["logit"]):
        parts = moved["offset"] + moved["scale"] + moved["shape"]
        assert parts == pytest.approx(moved["total"], rel=1e-10)
    assert drift["to_truth"][-1]["value"] == pytest.approx(distances["headline"]["value"], abs=1e-9)
    assert drift["normaliser"] == {"moved": False, "frozen": None}
    said = capsys.readouterr().out
    assert "distance to the hand-written reward" in said
    assert "by heart" in said


def test_a_probe_that_was_saved_says_what_one_that_is_played_does(
    train: Callable[..., Path], irl: Command
) -> None:
    run = train("run")
    irl("evaluate", run, *LOOK)
    played = files.read_json(run / "evaluation.json")["distances"]
    irl("probe", run, "--steps=90")
    irl("evaluate", run, "--episodes=2", "--probe", run / "probe.npz")
    assert files.read_json(run / "evaluation.json")["distances"] == played


def test_a_probe_of_another_task_is_one_line(train: Callable[..., Path], irl: Command, capsys) -> None:
    run = train("run")
    save_probe(ProbeSet("Other-v0", {"expert": tuple(pointmass.demonstrations(1))}), Path("p.npz"))
    capsys.readouterr()
    with pytest.raises(SystemExit) as stop:
        irl("evaluate", run, "--probe", "p.npz")
    assert stop.value.code == 2
    assert "is a probe of Other-v0" in capsys.readouterr().err


def test_arguments_beside_a_run_are_refused(irl: Command, train: Callable[..., Path], capsys) -> None:
    run = train("run")
    capsys.readouterr()
    with pytest.raises(SystemExit) as stop:
        irl("probe", run, "--steps=60", "--env-kwargs", "cliff=1", "--out=p.npz")
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert f"is a run of {TASK}; leave --env-kwargs out" in said
    assert f"irl probe --env-id {TASK} --env-kwargs cliff=1" in said
    assert not Path("p.npz").exists()


@pytest.mark.parametrize("words", [("probe",), ("probe", "--env-id=Pendulum-v1"), ("probe", "nowhere")])
def test_what_is_missing_for_a_probe_is_one_line(words, irl: Command, capsys) -> None:
    with pytest.raises(SystemExit) as stop:
        irl(*words)
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert any(hint in said for hint in ("give --env-id", "irl experts train", "holds no run"))


@pytest.mark.parametrize("scale", [0.0, 10.0])
def test_a_discriminator_is_judged_on_the_steps_it_was_shown(scale: float) -> None:
    episodes = tuple(pointmass.demonstrations(3))
    demos = Demos(episodes, (), (0, 1, 2), (), "irl/p-v0", TASK, Path(), None, None)
    given = GAILConfig(absorbing_scale=scale)
    kept = _learned_from(GAILRun(env_id=TASK, demo_rate=10, discriminator=given), demos)
    assert len(kept) == 9
    every = {tuple(row) for row in from_episodes(episodes).obs.tolist()}
    assert {tuple(row) for row in kept.obs.tolist()} < every


def test_the_parts_of_airl_are_apart(irl: Command) -> None:
    irl("train", "airl", "--env-id", TASK, "--out", "run", *QUICK)
    irl("evaluate", "run", *LOOK)
    parts = files.read_json(Path("run/evaluation.json"))["drift"]["parts"]
    assert list(parts) == ["logit", "f", "g", "h"]
    last = max(Path("run/snapshots").iterdir())
    snapshot = Snapshot(load_reward(last), load_policy(last / "policy.safetensors"))
    batch = from_episodes(pointmass.demonstrations(2))
    with torch.no_grad():
        of = {name: part(batch) for name, part in snapshot.parts.items()}
        torch.testing.assert_close(of["f"] - of["logit"], Density(snapshot.policy)(batch).clamp(-2, 2))
        gamma = snapshot.reward.spec.gamma
        after = snapshot.reward.net.h(replace(batch, obs=batch.next_obs))  # pyright: ignore
        torch.testing.assert_close(of["f"], of["g"] + gamma * after - of["h"])


@pytest.mark.parametrize("run", [AIRLRun, AIRLSACRun])
def test_the_density_of_an_exported_policy_is_the_learners(run) -> None:
    config = run(env_id=TASK, steps=64)
    if isinstance(config, AIRLRun):
        config = replace(config, learner=PPOConfig(n_envs=2, steps_per_round=64, batch_size=32))
    algorithm = build.imitation(config, pointmass.demonstrations(3))
    policy = algorithm.learner.policy()
    batch = from_episodes(rollouts(TASK, policy, [0, 1]) + pointmass.demonstrations(1))
    # SAC's hidden layers exchange bfloat16
    rtol, atol = (1e-4, 1e-4) if run is AIRLRun else (0.02, 0.1)
    torch.testing.assert_close(Density(policy)(batch), algorithm.learner.log_pi(batch), rtol=rtol, atol=atol)


def test_through_a_frozen_normaliser_only_the_networks_differ(train: Callable[..., Path]) -> None:
    last = max((train("run") / "snapshots").iterdir())
    snapshot = Snapshot(load_reward(last), load_policy(last / "policy.safetensors"))
    batch = from_episodes(pointmass.demonstrations(2))
    other = Normaliser(2)
    other.update(5 * batch.obs + 1)
    own = snapshot.reward.net.normaliser
    seen_by_other = replace(batch, obs=(batch.obs - other.mean) / other.std * own.std + own.mean)
    through = snapshot.normalised_by(other).reward(batch)
    torch.testing.assert_close(through, snapshot.reward(seen_by_other), rtol=1e-4, atol=1e-4)
    torch.testing.assert_close(snapshot.normalised_by(own).reward(batch), snapshot.reward(batch))
    assert np.isfinite(snapshot.logits(batch).detach().numpy()).all()
