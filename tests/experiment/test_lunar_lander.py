"""LunarLander, a task of Box2D's with a choice of actions: demonstrated, imported, learned from."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from irl.demos.info import show
from irl.demos.load import load_demos
from tests.demos.files import flat, write_npz
from tests.experiment.conftest import LOOK, QUICK

TASK = ("--env-id", "LunarLander-v3", "--datasets-root", "ds")

LANDER = """
import gymnasium as gym
from gymnasium.envs.box2d.lunar_lander import heuristic

ENV = gym.make("LunarLander-v3")

def act(obs):
    return heuristic(ENV, obs)
"""


def test_gail_learns_of_gymnasiums_own_lander(irl: Callable[..., None]) -> None:
    Path("their_lander.py").write_text(LANDER)
    irl("demos", "generate", *TASK, "--policy", "their_lander:act", "--episodes", 3, "--seed", 0)
    generated = show("irl/lunarlander/own-v0", Path("ds"))
    assert (generated.env_id, generated.action_size) == ("LunarLander-v3", 4)
    # 200 is a landing, random actions have about -180
    assert generated.return_mean > 200.0
    assert generated.random_return is not None
    assert generated.random_return < -100.0
    made = load_demos("irl/lunarlander/own-v0", root="ds")
    arrays = flat(list(made))
    write_npz(Path("landings.npz"), arrays | {"actions": arrays["actions"].argmax(1)})
    irl("demos", "import", "landings.npz", *TASK)
    for a, b in zip(load_demos("irl/lunarlander/imported-v0", root="ds"), made, strict=True):
        np.testing.assert_array_equal(a.obs, b.obs)
        np.testing.assert_array_equal(a.action, b.action)
    irl("train", "gail", *TASK, "--demos", "irl/lunarlander/imported-v0", "--demo-episodes=2",
        "--out", "run", *QUICK, "--steps=384")  # fmt: skip
    irl("evaluate", "run", *LOOK)
    assert json.loads(Path("run/evaluation.json").read_text())["policy"]["normalised_score"] is not None
    assert len(Path("run/metrics.jsonl").read_text().splitlines()) == 3
