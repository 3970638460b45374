"""What `irl evaluate` says of trusting a reward, and the gate that it has to pass."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from irl.algorithms.probe_set import ProbeSet
from irl.core import files
from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import from_episodes
from irl.diagnostics.ledger import F, G
from irl.diagnostics.verdicts import NAMES
from irl.envs.rollouts import rollouts
from irl.envs.tasks import task_name
from irl.experiment import evaluate
from irl.experiment.cli import main
from irl.experiment.crossplay import EPISODES, Played, Player, judge_cross_play, play_policies, returns_of
from irl.experiment.gate import BOUNDS, Gate, broken
from irl.experiment.trusted import _numbers, _proxy_gold, ledger_of
from irl.policies import shelf
from irl.policies.policy import Policy
from irl.report.folder import lookup
from irl.rewards.averaged import averaged
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.mujoco import HandWritten
from irl.rewards.shaped import ShapedNet, ShapedSpec
from tests import pointmass
from tests.experiment.conftest import DATASET, LOOK, QUICK, TASK
from tests.policies.test_shelf import a_card

Command = Callable[..., None]


@pytest.fixture(scope="module")
def judged(home: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The evaluation of a short run."""
    folder = tmp_path_factory.mktemp("judged")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("IRL_POLICIES_PATH", str(home / "policies"))
        patch.setenv("MINARI_DATASETS_PATH", str(home / "datasets"))
        patch.chdir(folder)
        main(["train", "gail", "--env-id", TASK, "--out", "run", *QUICK])
        main(["evaluate", "run", *LOOK])
    return files.read_json(folder / "run" / "evaluation.json")


def test_a_run_is_judged_by_policies_and_over_itself(judged: dict[str, Any]) -> None:
    found = judged
    cross, steps = found["cross_play"], found["drift"]["snapshots"]
    assert cross["snapshots"] == steps == [row["step"] for row in cross["agreement"]]
    policies = cross["policies"]
    kinds = {"checkpoint", "second-task", "expert", "medium", "noisy-expert", "random"}
    assert {policy["kind"] for policy in policies} == kinds
    assert np.shape(cross["learned"]) == (len(steps), len(policies))
    assert any("No second task" in note for note in cross["notes"])
    for row in cross["agreement"]:
        for name in ("pearson", "spearman", "kendall"):
            assert -1 <= row[name]["low"] <= row[name]["high"] <= 1
        assert 0 <= row["regret"]["value"] <= 1
    points = found["proxy_gold"]["points"]
    own = [p["true_return"] for p in policies if p["kind"] == "checkpoint"]
    assert [point["gold"] for point in points] == pytest.approx(own)
    # the last reward is the proxy of all, and at the last step its own
    assert (
        points[-1]["proxy"] == points[-1]["proxy_then"] == pytest.approx(cross["learned"][-1][len(own) - 1])
    )
    assert found["proxy_gold"]["peak_step"] in steps
    chosen = found["chosen"]
    assert chosen["step"] in steps[1:]
    assert [row["step"] for row in chosen["criteria"]] == steps
    assert chosen["compared"]["distance"]["of"] == len(steps) - 1
    assert [v["name"] for v in found["verdicts"]] == list(NAMES)
    assert {"kind", "determines", "cannot", "source"} <= set(found["ledger"])
    assert "no term" in found["residual"]["reason"]


def test_without_a_true_return_it_says_so(irl: Command) -> None:
    irl("train", "gail", "--env-id", "NaNReward-v0", "--demos", DATASET, "--out", "run", *QUICK)
    irl("evaluate", "run", *LOOK)
    found = files.read_json(Path("run/evaluation.json"))
    assert "not a finite number" in found["cross_play"]["reason"]
    assert "finite" in found["proxy_gold"]["reason"]
    verdict = {v["name"]: v for v in found["verdicts"]}
    assert verdict["hacked"]["fired"] is verdict["collapsed"]["fired"] is None
    assert verdict["hacked"]["reason"]
    assert verdict["flat"]["fired"] is not None
    assert found["chosen"]["step"] > 0


def test_the_truth_and_its_negation_on_real_policies() -> None:
    base = ProbeSet(TASK, {"expert": tuple(pointmass.demonstrations(5))})
    played = play_policies(TASK, {0: pointmass.expert()}, base, 0, Path("nowhere"))
    assert [p.name for p in played.players] == ["checkpoint at 0", "holding still", "expert"]
    assert played.players[1].episodes[0].action.any() == np.False_
    truth = HandWritten()
    returns = [returns_of(p.episodes, [truth, lambda b: -truth(b)]) for p in played.players]
    found = judge_cross_play(returns, [1, 2], played, 0)
    assert [row["regret"]["value"] for row in found["agreement"]] == [0.0, 1.0]
    assert found["agreement"][0]["kendall"]["value"] == pytest.approx(1.0)
    assert played.cost["steps"] == 2 * EPISODES * pointmass.STEPS


def test_a_policy_that_takes_other_observations_of_the_same_body_is_left_out(tmp_path: Path) -> None:
    one = pointmass.expert()
    wide = {"layers.0.weight": np.zeros((2, 3)), "obs_mean": np.zeros(3), "obs_std": np.ones(3)}
    variants = {"cliff": one, "shown": Policy(replace(one.spec, obs_dim=3), one.weights | wide)}
    for name, policy in variants.items():
        other = replace(policy.spec, env_id=f'{TASK}?{{"{name}":1}}')
        card = replace(a_card(one), env_id=other.env_id)
        shelf.write(tmp_path / task_name(other.env_id) / "expert", Policy(other, policy.weights), card)
    base = ProbeSet(TASK, {"expert": tuple(pointmass.demonstrations(1))})
    played = play_policies(TASK, {0: one}, base, 0, tmp_path)
    assert [p.name for p in played.players if p.kind == "second-task"] == [
        f'{TASK}?{{"cliff":1}} expert',
        "holding still",
    ]
    assert played.notes == (
        f'Left out: {TASK}?{{"shown":1}} expert, which takes observations of 3 and gives actions of 2, where '
        f"the task has 2 and 2.",
    )


def fallen(gold: list[float], proxy: list[float]) -> tuple[Any, Any]:
    """What is said of a run whose policies had these returns."""
    episodes = rollouts(TASK, pointmass.expert(), [0])
    players = tuple(Player(f"{i}", "checkpoint", episodes, i) for i in range(len(gold)))
    # each policy's episodes, and the last reward's opinion of them in the last column
    returns = [np.tile([g, *[0.0] * (len(gold) - 1), p], (3, 1)) for g, p in zip(gold, proxy, strict=True)]
    return _proxy_gold(Played(players), returns)


def test_a_fall_beside_a_rising_proxy_is_hacking_and_beside_a_falling_one_a_collapse() -> None:
    gold = [0.0, 5.0, 10.0, 4.0]
    content, (collapsed, hacked) = fallen(gold, [0.0, 1.0, 2.0, 3.0])
    assert (collapsed, hacked) == (0.0, pytest.approx(0.6))
    assert (content["peak_step"], content["fit"]) == (2, None)
    assert fallen(gold, [0.0, 1.0, 2.0, 0.5])[1] == (pytest.approx(0.6), 0.0)
    assert fallen([0.0, 5.0, 10.0, 11.0], [0.0, 1.0, 2.0, 3.0])[1] == (0.0, 0.0)
    unsaid = fallen(gold, [0.0, 1.0, 2.0, 2.0])[1]
    assert unsaid == "0.60 was lost while the learned return was the same within its errors"
    assert "never rose" in fallen([0.0, -1.0, -2.0, -3.0], [0.0, 1.0, 2.0, 3.0])[1]


def test_the_numbers_of_the_verdicts_are_where_their_rules_say() -> None:
    def hygiene(bias: float) -> dict[str, float]:
        return {"std": 0.5, "survival_bias": bias}

    drift = {
        "to_truth": [{"value": 0.9, "reason": None}, {"value": 0.4, "reason": None}],
        "to_final": [0.9, 0.5, 0.3, 0.1, 0.0],
        "health": [{"held_out": None, "train": {"saturated": 0.7}}],
        "hygiene": [hygiene(0.1), hygiene(-0.9)],
    }
    played = {"agreement": [{"regret": {"value": 0.1}}, {"regret": {"value": 0.6}}]}
    never = ProbeSet(TASK, {"expert": tuple(pointmass.demonstrations(2))})
    numbers, reasons = _numbers([0, 25, 50, 75, 100], drift, never, played, (0.0, 0.4))
    assert numbers == {
        "close": 0.4,
        "moved": 0.3,
        "stable": 0.1,
        "flat": 0.5,
        "saturated": 0.7,
        "survival-biased": None,
        "misleading": 0.6,
        "collapsed": 0.0,
        "hacked": 0.4,
    }
    assert "ends early" in reasons["survival-biased"]
    untold = drift | {"to_truth": [{"value": None, "reason": "the hand-written reward is constant"}]}
    alone = {"reason": "one policy is no order"}
    assert (
        "is constant" in _numbers([0, 100], untold | {"to_final": [0.9, 0.0]}, never, alone, "")[1]["close"]
    )
    two, why = _numbers([0, 100], drift | {"to_final": [0.9, 0.0]}, never, alone, "unknown")
    assert two["moved"] is two["stable"] is two["misleading"] is None
    assert why["misleading"] == "one policy is no order"
    fell = rollouts("Cliff-v0", lambda obs: np.ones(2), [0])
    ended = ProbeSet(TASK, {"x": tuple(fell)})
    numbers, _ = _numbers([0, 100], drift | {"to_final": [0.9, 0.0]}, ended, played, "")
    assert numbers["survival-biased"] == 0.9
    # nor is a reward blamed for what the hand-written one asks for
    paid = [replace(episode, reward=np.ones_like(episode.reward)) for episode in fell]
    numbers, reasons = _numbers([0, 25, 50, 75, 100], drift, ProbeSet(TASK, {"x": tuple(paid)}), played, "")
    assert numbers["survival-biased"] is None
    assert reasons["survival-biased"] == "the hand-written reward is at 1.00 itself"


@pytest.mark.parametrize("part", ["g", "f"])
def test_a_mean_of_rewards_determines_what_one_of_them_does(part: str) -> None:
    shape = ShapedSpec(2, 2, (4,), (4,), "tanh")
    steps = from_episodes(pointmass.demonstrations(1))
    rewards = []
    for i in range(2):
        net = ShapedNet(shape, fitted_normaliser(steps.obs), torch_stream(i, "net"))
        spec = RewardSpec(TASK, "airl", part, "obs, action", shape, 0.98, 1.0, i, {})
        rewards.append(LearnedReward(spec, net))
    assert ledger_of(averaged(rewards)) == ledger_of(rewards[0])
    assert ledger_of(rewards[0])["kind"] == (G if part == "g" else F)


def test_the_gate_is_held_against_every_bound() -> None:
    evaluation = {
        "policy": {"normalised_score": 0.8},
        "distances": {"headline": {"value": None}},
        "cross_play": {"agreement": [{"kendall": {"value": 0.1}}, {"kendall": {"value": 0.7}}]},
        "verdicts": [
            {"name": "close", "fired": False, "value": 0.44, "threshold": 0.15, "reason": None},
            {"name": "hacked", "fired": True, "value": 0.5, "threshold": 0.2, "reason": None},
            {"name": "flat", "fired": None, "value": None, "threshold": 0.1, "reason": "unknown"},
        ],
    }
    passed = Gate({"score": (0.8, 1.0), "kendall": (0.5, 1.0)}, {"hacked": True})
    assert broken(passed, evaluation) == []
    failed = Gate(
        {"score": (0.9, np.inf), "distance": (-np.inf, 0.3)}, {"hacked": False, "flat": False, "close": True}
    )
    lines = broken(failed, evaluation)
    assert lines[0] == "score is 0.8, and was to be 0.9 or more"
    assert lines[1] == "distance is not known, and was to be 0.3 or less"
    assert "hacked fired: 0.5 against 0.2" in lines[2]
    assert lines[3] == "flat was not judged: unknown"
    assert lines[4] == "close did not fire: 0.44 against 0.15"


def test_a_broken_bound_is_exit_status_1_and_a_kept_one_0(
    judged: dict[str, Any], irl: Command, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    for path in BOUNDS.values():
        whole = judged | {"last_agreement": judged["cross_play"]["agreement"][-1]}
        # of a short run's policy no gain is known, nor of the point mass a term
        known = lookup(whole, path) is not None
        assert known or path.startswith("terms") or path == "proxy_gold.drop", path
    monkeypatch.setattr(evaluate, "evaluation", lambda folder, command: judged)
    Path("run").mkdir()
    files.write_json(Path("run/config.json"), {})
    Path("kept.toml").write_text("[bounds]\nreturn = { max = 1e9 }\n[verdicts]\nsaturated = false\n")
    irl("evaluate", "run", "--gate", "kept.toml")
    Path("broken.toml").write_text("[bounds]\nreturn = { min = 1e9 }\n")
    with pytest.raises(SystemExit) as stop:
        irl("evaluate", "run", "--gate", "broken.toml")
    assert stop.value.code == 1
    assert "return is" in capsys.readouterr().err
