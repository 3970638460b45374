"""`irl retrain` end to end on small tasks: fresh weights, a frozen reward, nothing of the task's own."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from irl.core import files
from irl.core.config import from_json, to_json
from irl.core.records import open_run
from irl.core.types import Transitions
from irl.diagnostics.stack import read_episodes
from irl.envs.rollouts import rollouts
from irl.experiment import build, play
from irl.experiment.cli import main
from irl.experiment.configs import OFF_POLICY, OFF_POLICY_TD3, RetrainRun, Watch
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig
from irl.learners.td3 import TD3Config
from irl.policies.policy import load_policy
from irl.rewards.artefact import POLICY, load_reward
from irl.rewards.maps import MAPS
from irl.rewards.nets import LogitNet
from tests.experiment.conftest import DATASET, QUICK, TASK

Command = Callable[..., None]

SMALL = {
    "ppo.n-envs": 2,
    "ppo.steps-per-round": 128,
    "ppo.batch-size": 64,
    "ppo.n-epochs": 2,
    "ppo.hidden": 16,
}
SMALL_SAC = {
    "sac.steps-per-round": 100,
    "sac.learning-starts": 100,
    "sac.batch-size": 32,
    "sac.hidden": 16,
}
WATCH = ["--watch.no-progress", "--watch.no-tensorboard", "--watch.eval-every=2", "--watch.eval-episodes=2"]
PPO = [f"--{name}={value}" for name, value in SMALL.items()] + WATCH
SAC = ["--algo=sac", "--steps=400"] + [f"--{name}={value}" for name, value in SMALL_SAC.items()] + WATCH
DAC = [f"--{name}={value}" for name, value in SMALL_SAC.items()] + WATCH
DAC = [word.replace("--sac.", "--learner.") for word in DAC] + ["--discriminator.hidden=16", "--steps=400"]
WORDS = {"ppo": PPO, "sac": SAC}


@pytest.fixture(scope="session")
def trained(home: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two runs of GAIL, one whose task pays NaN, and one of DAC on a task that ends early."""
    folder = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("IRL_POLICIES_PATH", str(home / "policies"))
        patch.setenv("MINARI_DATASETS_PATH", str(home / "datasets"))
        patch.chdir(folder)
        play_words = ["--demos", DATASET, "--watch.no-tensorboard"]
        for name, env_id in (("gail", TASK), ("nan", "NaNReward-v0")):
            main(["train", "gail", "--env-id", env_id, "--out", name, *QUICK, *play_words])
        main(["train", "dac", "--env-id", "Cliff-v0", "--out", "dac", *play_words, *DAC])
    return folder


@pytest.fixture
def runs(trained: Path, irl: Command) -> None:
    """Copies of those runs where the test is."""
    for name in ("gail", "nan", "dac"):
        shutil.copytree(trained / name, name)


def policies(run: Path | str) -> list[dict[str, np.ndarray]]:
    """The weights of every snapshot's policy."""
    found = open_run(Path(run)).snapshots().values()
    return [load_policy(path / "policy.safetensors").weights for path in found]


def equal(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


def settings(
    learner: PPOConfig | SACConfig | TD3Config,
    env_id: str = TASK,
    entropy: float = 0.0,
    hand_written: bool = False,
) -> RetrainRun:
    reward, watch = (Path("run"), 128, False, hand_written), Watch(eval_every=3)
    return RetrainRun(*reward, env_id, 400, 3, Path("out"), learner, entropy, watch, "cpu", 2)


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize("algo", WORDS)
def test_it_reports_the_true_return_beside_the_learned_one(
    irl: Command, capsys: pytest.CaptureFixture, algo: str
) -> None:
    irl("retrain", "gail", "--out", "again", *WORDS[algo])
    said = capsys.readouterr().out
    result = files.read_json(Path("again/retrain.json"))
    assert (result["algorithm"], result["seed"], result["env_id"]) == (algo, 1000, TASK)
    weights = Path("gail/snapshots/000000768/reward/weights.safetensors")
    reward = {"run": "gail", "env_steps": 768, "method": "gail", "weights_sha256": files.sha256(weights)}
    assert reward.items() <= result["reward"].items()
    for name in ("true", "learned"):
        returns = result[name]["returns"]
        assert len(returns) == result["episodes"] == 20
        assert result[name]["return_mean"] == pytest.approx(np.mean(returns))
        assert result[name]["return_std"] == pytest.approx(np.std(returns))
        assert result[name]["return_min"] == min(returns)
        assert f"{np.mean(returns):.1f}" in said
    true = result["true"]
    span = true["expert_return_mean"] - true["random_return_mean"]
    assert true["normalised_score"] == pytest.approx(
        (true["return_mean"] - true["random_return_mean"]) / span
    )
    rows = [row for row in open_run(Path("again")).metrics() if "eval_return_mean" in row]
    assert rows
    # GAIL pays for each step, the point mass never does
    assert all(row["eval_learned_return_mean"] > 0.0 > row["eval_return_mean"] for row in rows)
    first, *later = result["proxy_gold"]["points"]
    assert [point["gold"] for point in later] == [row["eval_return_mean"] for row in rows]
    assert [point["gold_error"] for point in later] == [row["eval_return_stderr"] for row in rows]
    assert first["step"] == 0
    assert first["proxy"] > 0.0 > first["gold"]
    assert all(point["gold_error"] > 0.0 for point in (first, *later))


@pytest.mark.usefixtures("runs")
def test_the_weights_are_fresh_and_the_seed_is_another(irl: Command) -> None:
    irl("retrain", "gail", "--out", "a", *PPO)
    irl("retrain", "gail", "--out", "b", "--seed", "7", *PPO)
    irl("retrain", "gail", "--out", "c", *PPO)
    first, a, b, c = policies("gail")[0], policies("a"), policies("b"), policies("c")
    weight = "layers.0.weight"
    assert not np.array_equal(first[weight], a[0][weight])
    assert not np.array_equal(a[0][weight], b[0][weight])
    assert not np.array_equal(a[0][weight], a[-1][weight])
    assert all(equal(x, y) for x, y in zip(a, c, strict=True))


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize("algo", WORDS)
def test_the_tasks_own_reward_replaced_by_nan_changes_no_weight(irl: Command, algo: str) -> None:
    for name in ("gail", "nan"):
        irl("retrain", name, "--out", f"{name}-again", *WORDS[algo])
    assert all(equal(a, b) for a, b in zip(policies("gail-again"), policies("nan-again"), strict=True))
    result = files.read_json(Path("nan-again/retrain.json"))
    assert result["true"]["return_mean"] is result["true"]["normalised_score"] is None
    assert np.isfinite(result["learned"]["return_mean"])


@pytest.mark.usefixtures("runs")
def test_the_reward_is_that_of_the_snapshot_and_decides_what_is_learned(irl: Command) -> None:
    irl("retrain", "gail", "--out", "last", *PPO)
    irl("retrain", "gail", "--snapshot", "128", "--out", "early", *PPO)
    assert files.read_json(Path("early/retrain.json"))["reward"]["env_steps"] == 128
    early, last = policies("early"), policies("last")
    # one seed: the same start, another end
    assert equal(early[0], last[0])
    assert not equal(early[-1], last[-1])


@pytest.mark.usefixtures("runs")
def test_an_average_is_the_mean_of_the_snapshots_so_far(irl: Command) -> None:
    irl("retrain", "gail", "--average", "--snapshot", "256", "--seeds", "7", "--out", "mean", *PPO)
    (folder,) = Path("mean").iterdir()
    found = files.read_json(folder / "retrain.json")
    over = {int(steps): digest for steps, digest in found["reward"]["average_over"].items()}
    there = open_run(Path("gail")).snapshots()
    assert list(over) == [steps for steps in there if 0 < steps <= 256]
    assert len(over) > 1
    assert all(files.sha256(there[at] / "reward/weights.safetensors") == over[at] for at in over)
    starts = found["episode_seeds"]
    last = list(open_run(folder).snapshots().values())[-1]
    episodes = rollouts(TASK, load_policy(last / POLICY), starts)
    rewards = [load_reward(there[at]) for at in over]
    paid = [sum(float(given.sum()) for given in read_episodes(r, episodes)) / len(rewards) for r in rewards]
    assert found["learned"]["return_mean"] * len(starts) == pytest.approx(sum(paid), rel=1e-4)
    (row,) = files.read_json(Path("gail/retrained.json"))["rows"]
    assert row["part"] == f"gail, mean of {len(over)}"


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize("algo", WORDS)
def test_the_hand_written_reward_is_learned_from_by_the_same_learner(irl: Command, algo: str) -> None:
    irl("retrain", "gail", "--out", "learned", *WORDS[algo])
    irl("retrain", "gail", "--hand-written", "--seeds", "1000", "--out", "control", *WORDS[algo])
    (control,) = Path("control").iterdir()
    assert control.name == f"retrain-gail-768-hand-written-{algo}-s1000"
    learned, written = policies("learned"), policies(control)
    assert equal(learned[0], written[0])
    assert not equal(learned[-1], written[-1])
    assert files.read_json(control / "retrain.json")["reward"]["hand_written"] is True
    assert "hand_written" not in files.read_json(Path("learned/retrain.json"))["reward"]
    (row,) = files.read_json(Path("gail/retrained.json"))["rows"]
    assert row["part"] == "hand-written"
    # begun before there was a setting, whose default is what it was then
    older = {k: v for k, v in files.read_json(control / "config.json").items() if k != "average"}
    files.write_json(control / "config.json", older)
    irl("retrain", "gail", "--hand-written", "--seeds", "1000", "--out", "control", *WORDS[algo])
    # nothing of the learned reward decides it
    irl("retrain", "gail", "--hand-written", "--snapshot", "128", "--out", "early", *WORDS[algo])
    assert all(equal(a, b) for a, b in zip(policies("early"), written, strict=True))


@pytest.mark.usefixtures("runs")
def test_the_reward_of_one_snapshot_needs_no_other(irl: Command) -> None:
    shutil.rmtree("gail/snapshots/000000128/reward")
    irl("retrain", "gail", "--out", "again", *PPO)
    assert "average_over" not in files.read_json(Path("again/reward.json"))


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize("algo", WORDS)
def test_the_observations_are_normalised_as_the_reward_does_and_the_reward_stays_as_it_is(
    irl: Command, algo: str
) -> None:
    before = {path: path.read_bytes() for path in Path("gail").rglob("*") if path.is_file()}
    irl("retrain", "gail", "--out", "again", *WORDS[algo])
    normaliser = load_reward("gail").net.normaliser
    for weights in policies("again"):
        np.testing.assert_array_equal(weights["obs_mean"], normaliser.mean.numpy())
        np.testing.assert_array_equal(weights["obs_std"], normaliser.std.numpy())
    assert {path: path.read_bytes() for path in Path("gail").rglob("*") if path.is_file()} == before


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize("algo", WORDS)
def test_a_run_that_died_is_resumed_to_the_same_end(
    irl: Command, monkeypatch: pytest.MonkeyPatch, algo: str
) -> None:
    words = ["retrain", "dac", *WORDS[algo], "--algo", algo]
    irl(*words, "--out", "straight")

    class Died(Exception):
        pass

    def die(row: dict, steps_per_s: float) -> str:
        if row["round"] == 3:
            raise Died
        return ""

    with monkeypatch.context() as patched:
        patched.setattr(play, "training_words", die)
        with pytest.raises(Died):
            irl(
                "retrain",
                "dac",
                "--out",
                "died",
                *WORDS[algo],
                "--algo",
                algo,
                "--watch.checkpoint-every-s=0",
            )
    # renamed meanwhile
    Path("dac").rename("moved")
    config = files.read_json(Path("died/config.json"))
    files.write_json(Path("died/config.json"), config | {"run": "moved"})
    irl("retrain", "--resume", "died")
    assert all(equal(a, b) for a, b in zip(policies("straight"), policies("died"), strict=True))
    assert files.read_json(Path("died/retrain.json")) == files.read_json(Path("straight/retrain.json"))


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize(
    ("name", "env_id", "written", "absorbs"),
    [("dac", "Cliff-v0", False, True), ("gail", TASK, False, False), ("dac", "Cliff-v0", True, False)],
)
def test_terminations_lead_into_the_absorbing_state_where_the_reward_knows_one(
    name: str, env_id: str, written: bool, absorbs: bool
) -> None:
    small = SACConfig(steps_per_round=200, learning_starts=300, batch_size=64, hidden=(8,))
    algorithm = build.on_frozen(settings(small, env_id, hand_written=written), load_reward(name))
    seen: list[Transitions] = []

    def remember(batch: Transitions) -> Tensor:
        seen.append(batch)
        return torch.zeros(len(batch))

    algorithm.learner.start(remember)
    steps = [algorithm.learner.collect() for _ in range(2)]
    algorithm.learner.close()
    assert any(bool(batch.terminated.any()) for batch in steps) == (env_id != TASK)
    assert len(seen) == 100
    assert any(bool(batch.terminated.any()) for batch in seen) == written
    assert any(batch.absorbing is not None and bool(batch.absorbing.any()) for batch in seen) == absorbs
    if written:
        assert all(torch.equal(algorithm.reward(b), torch.as_tensor(b.reward)) for b in (*steps, *seen))


@pytest.mark.usefixtures("runs")
def test_ppo_is_paid_each_step_above_what_the_absorbing_state_pays() -> None:
    # wild enough to fall off
    small = PPOConfig(n_envs=2, steps_per_round=1024, batch_size=64, hidden=(8,), gamma=0.5, log_std_init=1.0)
    reward = load_reward("dac")
    algorithm = build.on_frozen(settings(small, "Cliff-v0"), reward)
    batch = algorithm.learner.collect()
    algorithm.learner.close()
    assert batch.terminated.any()
    assert isinstance(reward.net, LogitNet)
    pays = MAPS[reward.spec.reward_map]
    of_absorbing = pays(reward.net.of_absorbing())
    assert of_absorbing.abs() > 1e-3
    # at a termination too, and whatever PPO's gamma
    torch.testing.assert_close(algorithm.reward(batch), pays(reward.net(batch)) - of_absorbing)


@pytest.mark.usefixtures("runs")
def test_ppo_is_paid_for_the_entropy_that_it_has_by_then() -> None:
    small = PPOConfig(n_envs=2, steps_per_round=128, batch_size=64, hidden=(8,), lr=0.1)
    algorithm = build.on_frozen(settings(small, entropy=0.5), reward := load_reward("gail"))
    learner = algorithm.learner
    assert isinstance(learner, PPOLearner)
    densities = []
    for _ in range(2):
        batch = learner.collect()
        densities.append(learner.log_pi(batch).clamp(-10.0, 10.0))
        torch.testing.assert_close(algorithm.reward(batch), reward(batch) - 0.5 * densities[-1])
        learner.improve(algorithm.reward)
    learner.close()
    assert densities[0].std() > 0
    assert not torch.allclose(densities[0].mean(), densities[1].mean(), atol=1e-3)


def test_the_settings_come_back_from_json() -> None:
    for learner in (PPOConfig(lr=1e-3), OFF_POLICY, OFF_POLICY_TD3):
        config = settings(learner)
        assert from_json(RetrainRun, json.loads(json.dumps(to_json(config)))) == config


@pytest.mark.usefixtures("runs")
def test_the_learner_is_that_of_the_run_unless_another_is_typed(irl: Command) -> None:
    irl("retrain", "dac", *[word for word in SAC if not word.startswith("--algo")])
    assert Path("runs/retrain-dac-400-sac-s1000/retrain.json").is_file()


MISTAKES = {
    "no run": ("retrain", ["--resume"]),
    "both": ("retrain gail --resume done", ["--resume"]),
    "a run that is not there": ("retrain nowhere", ["nowhere", "config.json"]),
    "a snapshot that is not there": ("retrain gail --snapshot 5", ["5", "768", "--snapshot"]),
    "no steps": ("retrain gail --steps 0", ["steps", "0"]),
    "a negative seed": ("retrain gail --seed -1", ["seed", "-1"]),
    "a part of the hand-written reward": (
        "retrain gail --hand-written --part g",
        ["--hand-written", "--part"],
    ),
    "negative entropy": ("retrain gail --entropy -1", ["entropy", "-1"]),
    "entropy beside SAC's": ("retrain gail --algo sac --entropy 1", ["--entropy", "PPO", "--sac.ent-coef"]),
    "settings of the other learner": ("retrain gail --sac.lr 0.1", ["--sac.*", "--algo sac"]),
    "a retrained run's reward": ("retrain done", ["kind", "retrain"]),
    "a folder with a run": ("retrain gail --out done", ["done", "irl retrain --resume done"]),
    "a folder with another run": ("retrain gail --out dac", ["dac", "irl train --resume dac"]),
    "going on with other settings": ("retrain --resume done --seed 3", ["done", "--out"]),
    "going on with what is none of its own": ("retrain --resume gail", ["gail", "irl train --resume gail"]),
    "going on with what is no run": ("retrain --resume nowhere", ["nowhere"]),
    "going on by the command for imitation": ("train --resume done", ["irl retrain --resume done"]),
    "another reward now": ("retrain --resume swapped", ["reward.json", "--out"]),
    "the run gone": ("retrain --resume orphan", ["gone", "config.json"]),
    "a task of an unknown module": ("retrain --resume evil", ["evil_module", "IRL_ENV_MODULES"]),
}


@pytest.fixture(scope="session")
def mistaken(trained: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The runs of `trained`, a finished retraining, and damaged ones."""
    folder = tmp_path_factory.mktemp("mistaken")
    shutil.copytree(trained, folder, dirs_exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        main(["retrain", "gail", "--out", "done", *PPO])
    for name in ("swapped", "orphan", "evil"):
        shutil.copytree(folder / "done", folder / name)
    record = files.read_json(folder / "swapped/reward.json")
    files.write_json(folder / "swapped/reward.json", record | {"weights_sha256": "0" * 64})
    for name, change in (("orphan", {"run": "gone"}), ("evil", {"env_id": "evil_module:X-v0"})):
        files.write_json(folder / name / "config.json", files.read_json(folder / "done/config.json") | change)
    return folder


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_and_leaves_nothing(
    mistake: str, irl: Command, mistaken: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(mistaken)
    words, expected = MISTAKES[mistake]
    before = sorted(mistaken.rglob("*"))
    with pytest.raises(SystemExit) as stopped:
        irl(*words.split())
    said = capfd.readouterr()
    assert stopped.value.code == 2
    assert said.err.count("\n") == 1, said.err
    assert [word for word in expected if word not in said.err] == [], said.err
    assert sorted(mistaken.rglob("*")) == before
