"""`irl train bc` end to end on a small task, and cloning as a warm start."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from irl.core import files
from irl.core.records import open_run
from irl.core.types import from_episodes
from irl.demos.load import load_demos
from irl.policies.policy import load_policy
from irl.policies.trainable import TrainablePolicy
from tests.experiment.conftest import DATASET, LOOK, QUICK, TASK

Command = Callable[..., None]
Train = Callable[..., Path]
WORDS = (
    "--steps=60",
    "--learner.steps-per-round=20",
    "--learner.hidden=16",
    "--watch.eval-every=2",
    "--watch.eval-episodes=2",
    "--watch.no-progress",
)


def weights(run: Path, which: int = -1) -> dict[str, np.ndarray]:
    return load_policy(list(open_run(run).snapshots().values())[which] / "policy.safetensors").weights


def equal(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


def density_of_demonstrations(run: Path) -> float:
    """Mean log density of the expert's actions under the first policy of a run."""
    policy = load_policy(next(iter(open_run(run).snapshots().values())) / "policy.safetensors")
    batch = from_episodes(load_demos(DATASET, episodes=4, seed=3))
    return float(TrainablePolicy(policy, -2.0)(batch).detach().mean())


@pytest.fixture
def clone(irl: Command) -> Train:
    def run(out: str, *more: str) -> Path:
        irl("train", "bc", "--env-id", TASK, "--demo-episodes=4", "--out", out, *WORDS, *more)
        return Path(out)

    return run


def test_its_run_folder_is_like_the_others(clone: Train, irl: Command) -> None:
    run = clone("run")
    config = files.read_json(run / "config.json")
    assert (config["kind"], config["learner"]["policy"]) == ("bc", "gaussian")
    rows = open_run(run).metrics()
    assert [row["env_steps"] for row in rows] == [20, 40, 60]
    assert {"bc/log_pi", "bc/log_pi_held_out"} <= set(rows[0])
    assert rows[-1]["bc/log_pi"] > rows[0]["bc/log_pi"]
    assert list(open_run(run).snapshots())[-1] == 60
    irl("train", "--config", run / "config.json", "--out", "again")
    assert equal(weights(run), weights(Path("again")))
    irl("export", run)


def test_a_run_that_was_cut_off_goes_on_to_the_same_weights(
    clone: Train, irl: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    straight = clone("straight", "--watch.checkpoint-every-s=0")
    cut = clone("cut", "--watch.checkpoint-every-s=0")
    newest = list(open_run(cut).checkpoints().values())[-1]
    (newest / "state.safetensors").write_bytes(b"torn")
    irl("train", "--resume", cut)
    assert equal(weights(straight), weights(cut))


def test_evaluate_measures_the_policy_and_says_that_there_is_no_reward(
    clone: Train, irl: Command, capsys: pytest.CaptureFixture
) -> None:
    run = clone("run", "--learner.policy=squashed_gaussian")
    irl("evaluate", run, *LOOK)
    found = files.read_json(run / "evaluation.json")
    assert found["policy"]["episodes"] == 2
    assert "learns no reward" in found["reward"]["notes"][0]
    assert "learns no reward" in found["distances_reason"]
    printed = " ".join(capsys.readouterr().out.split())
    assert "learns no reward" in printed
    assert "nor a reason" not in printed
    assert (run / "report.html").is_file()
    with pytest.raises(SystemExit):
        irl("retrain", run)
    assert "no reward to retrain on" in capsys.readouterr().err


def test_a_warm_start_is_recorded_and_the_first_policy_is_the_cloned_one(train: Train) -> None:
    cold = train("cold")
    warm = train("warm", "--warm-start.updates=20")
    again = train("again", "--warm-start.updates=20")
    assert files.read_json(cold / "config.json")["warm_start"]["updates"] == 0
    assert files.read_json(warm / "config.json")["warm_start"]["updates"] == 20
    assert density_of_demonstrations(warm) > density_of_demonstrations(cold) + 0.1
    assert equal(weights(again), weights(warm))


def test_off_policy_methods_start_warm_too(irl: Command) -> None:
    words = "--steps 16 --learner.steps-per-round 8 --learner.learning-starts 4 --learner.batch-size 4"
    quick = "--learner.hidden 8 --learner.quantiles 0 --watch.eval-episodes 0 --watch.no-progress"
    for method in ("dac", "airl-sac"):
        for updates in ("0", "20"):
            where = ("--out", f"{method}-{updates}", "--warm-start.updates", updates)
            demos = ("--demo-episodes", "2", "--learner.products", "float32")
            irl("train", method, "--env-id", TASK, *words.split(), *quick.split(), *where, *demos)
        cold, warm = (density_of_demonstrations(Path(f"{method}-{n}")) for n in (0, 20))
        assert warm > cold + 0.1


def test_demonstrations_are_needed_with_actions(irl: Command, capsys: pytest.CaptureFixture) -> None:
    assert QUICK
    with pytest.raises(SystemExit):
        irl("train", "bc", "--env-id", TASK, "--learner.batch-size=0", "--out", "x")
    assert "batch_size must be at least 1" in capsys.readouterr().err
