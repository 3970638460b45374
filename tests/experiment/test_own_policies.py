"""`irl demos generate --policy`: a zip of Stable-Baselines3's, a file of irl's, a function of the user's."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from irl.demos.info import show
from irl.demos.load import load_demos
from irl.envs.rollouts import rollouts
from tests.experiment.conftest import TASK
from tests.learners.test_sb3_import import OLD

Command = Callable[..., None]

MODULE = """
import numpy as np

def to_the_origin(obs):
    return np.clip(-5 * obs, -1, 1)

def none(obs):
    return np.zeros(3)

def broken(obs):
    raise KeyError("speed")
"""


def refused(irl: Command, capfd: pytest.CaptureFixture, *words: object) -> str:
    with pytest.raises(SystemExit) as stopped:
        irl("demos", "generate", *words)
    assert stopped.value.code == 2
    return capfd.readouterr().err.splitlines()[-1]


def test_an_old_zip_demonstrates_the_new_task(irl: Command, capfd: pytest.CaptureFixture) -> None:
    words = ("--env-id", "Hopper-v5", "--episodes", 2, "--datasets-root", "ds", "--policy", OLD)
    irl("demos", "generate", *words, "--vec-normalize", OLD.with_suffix(".pkl"))
    assert "pickles can run any code" in capfd.readouterr().err
    info = show("irl/hopper/own-v0", Path("ds"))
    assert info.env_id == "Hopper-v5"
    assert info.algorithm == "Stable-Baselines3 ActorCriticPolicy"
    assert info.terms == ("forward", "ctrl", "survive")
    assert info.random_return is not None


def test_a_function_by_its_name(irl: Command, capfd: pytest.CaptureFixture) -> None:
    Path("their_policy_module.py").write_text(MODULE)
    words = ("--env-id", TASK, "--episodes", 2, "--datasets-root", "ds")
    irl("demos", "generate", *words, "--policy", "their_policy_module:to_the_origin")
    (first, _) = load_demos("irl/pointmass/own-v0", root="ds")
    expected = rollouts(TASK, lambda obs: np.clip(-5 * obs, -1, 1), [first.seed or 0])[0]
    np.testing.assert_array_equal(first.obs, expected.obs)
    for function, said in (
        ("none", "expected actions of shape (2,), the policy gave (3,)"),
        ("broken", "raised KeyError: 'speed'"),
        ("other", "has no function 'other'"),
    ):
        line = refused(irl, capfd, *words, "--overwrite", "--policy", f"their_policy_module:{function}")
        assert said in line
    assert "no_such_module" in refused(irl, capfd, *words, "--policy", "no_such_module:act")
    assert "expected FILE.zip" in refused(irl, capfd, *words, "--policy", "policy.txt")
    assert "with --policy" in refused(irl, capfd, *words, "--vec-normalize", "a.pkl")


def test_a_policy_of_irl(irl: Command, home: Path) -> None:
    policy = home / "policies" / "pointmass" / "expert" / "policy.safetensors"
    irl("demos", "generate", "--env-id", TASK, "--episodes", 1, "--datasets-root", "ds", "--policy", policy)
    info = show("irl/pointmass/own-v0", Path("ds"))
    assert (info.algorithm, info.expert_return is None) == ("irl", False)
