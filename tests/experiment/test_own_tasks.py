"""Tasks that are not MuJoCo's: with a choice of actions, in a module of the user's, with arguments."""

import json
import os
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Dict, Discrete
from stable_baselines3 import PPO

from irl.bench.leash import PROGRAM
from irl.bench.processes import Processes
from irl.core.records import open_run
from irl.core.types import Episode, from_episodes
from irl.demos.curate import _write_part
from irl.demos.generate import generate
from irl.demos.load import load_demos
from irl.demos.storage import open_dataset
from irl.envs.inherited import VARIABLE
from irl.envs.names import full_name
from irl.envs.rollouts import rollouts
from irl.experiment.cli import COMMANDS
from irl.policies.policy import load_policy
from irl.rewards.artefact import load_reward
from irl.rewards.wrapper import RewardWrapper
from tests import pointmass
from tests.demos.files import flat, write_npz
from tests.demos.test_minari import buffer, written
from tests.experiment.conftest import LOOK, QUICK, TASK

Command = Callable[..., None]

FAST = ("--learner.n-epochs=10", "--watch.eval-every=0", "--watch.no-progress", "--watch.no-tensorboard")


def balance(obs: np.ndarray) -> np.ndarray:
    """Pushes the cart below the pole: 500 of 500 steps, every time."""
    return np.asarray(int(obs @ np.array([0.1, 0.4, 3.0, 1.0]) > 0))


def cartpole(irl: Command, episodes: int = 6) -> None:
    """Import demonstrations of CartPole from an npz with choices as whole numbers."""
    made = rollouts("CartPole-v1", balance, range(episodes))
    assert [len(episode) for episode in made] == [500] * episodes
    arrays = flat(made)
    write_npz(Path("cartpole.npz"), arrays | {"actions": arrays["actions"].argmax(1)})
    irl("demos", "import", "cartpole.npz", "--env-id", "CartPole-v1", "--datasets-root", "ds")


TRAIN = ["train", "gail", "--env-id", "CartPole-v1", "--demos", "irl/cartpole/imported-v0", "--out", "run"]
TRAIN += ["--datasets-root", "ds"]


@pytest.mark.slow
def test_gail_balances_cartpole_from_imported_demonstrations(irl: Command) -> None:
    cartpole(irl)
    irl(*TRAIN, "--seed", 0, "--steps", 16_384, *FAST)
    irl("evaluate", "run", "--episodes", 20, "--seed", 5)
    found = json.loads(Path("run/evaluation.json").read_text())
    assert found["policy"]["return_mean"] >= 475.0
    assert found["policy"]["normalised_score"] >= 0.94


def test_what_is_learned_of_a_choice_is_evaluated_exported_and_paid(irl: Command) -> None:
    cartpole(irl)
    irl(*TRAIN, *QUICK)
    irl("evaluate", "run", *LOOK)
    assert json.loads(Path("run/evaluation.json").read_text())["policy"]["normalised_score"] is not None
    assert Path("run/report.html").is_file()
    small = ("--ppo.n-envs=2", "--ppo.steps-per-round=128", "--ppo.batch-size=64", "--watch.no-progress")
    irl("retrain", "run", "--steps", 128, "--out", "again", *small)
    _, snapshot = list(open_run(Path("run")).snapshots().items())[-1]
    policy = load_policy(snapshot / "policy.safetensors")
    assert policy.spec.distribution == "categorical"
    (episode,) = rollouts("CartPole-v1", policy, [3])
    _exported(irl, episode.obs, episode.action)
    _paid(episode, snapshot)


def _exported(irl: Command, obs: np.ndarray, action: np.ndarray) -> None:
    irl("export", "run", "--out", "policy.zip")
    model = PPO.load("policy.zip", device="cpu")
    chosen, _ = model.predict(obs[:-1].astype(np.float32), deterministic=True)
    np.testing.assert_array_equal(chosen, action.argmax(1))


def _paid(episode: Episode, snapshot: Path) -> None:
    """The learned reward around the environment itself, which takes choices."""
    reward = load_reward(snapshot)
    env = RewardWrapper(gym.make("CartPole-v1"), reward)
    env.reset(seed=3)
    paid = [env.step(int(choice))[1] for choice in episode.action.argmax(1)]
    with torch.no_grad():
        expected = reward(from_episodes([episode])).tolist()
    np.testing.assert_allclose(paid, expected, rtol=1e-4)
    env.close()


def test_sac_is_refused_where_actions_are_a_choice(irl: Command, capfd: pytest.CaptureFixture) -> None:
    cartpole(irl, 1)
    demos = "--demos irl/cartpole/imported-v0 --demo-episodes 1 --datasets-root ds"
    commands = (
        f"train dac --env-id CartPole-v1 {demos}",
        "experts train --env-id CartPole-v1 --algo sac --policies-root shelf",
    )
    for words in commands:
        with pytest.raises(SystemExit):
            irl(*words.split(), "--out", "refused")
        assert (
            "SAC takes actions that are real numbers, CartPole-v1 has a choice of 2" in capfd.readouterr().err
        )
        assert not Path("refused").exists()


def test_airl_is_refused_where_actions_are_a_choice(irl: Command, capfd: pytest.CaptureFixture) -> None:
    cartpole(irl, 1)
    demos = "--demos irl/cartpole/imported-v0 --demo-episodes 1 --datasets-root ds"
    with pytest.raises(SystemExit):
        irl(*f"train airl --env-id CartPole-v1 {demos}".split(), "--out", "refused")
    said = capfd.readouterr().err
    assert (
        "AIRL takes the density of actions that are real numbers off, CartPole-v1 has a choice of 2" in said
    )
    assert said.count("\n") == 1
    assert not Path("refused").exists()


THEIRS = """
import gymnasium as gym
from tests.pointmass import PointMass

# as a function, which Gymnasium cannot write down
make = lambda **kwargs: PointMass(**kwargs)
gym.register("Theirs-v0", make, max_episode_steps=30, disable_env_checker=True)

def act(obs):
    return -5 * obs
"""


@pytest.fixture
def theirs() -> str:
    """A module in the working folder that registers a task."""
    Path("their_task_module.py").write_text(THEIRS)
    return "their_task_module"


def test_a_task_of_a_module_with_arguments(
    irl: Command, theirs: str, capfd: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", "ds")
    task = ("--env-id", "Theirs-v0", "--env-kwargs", "cliff=1.2", "--import", theirs)
    with pytest.raises(SystemExit):
        irl("demos", "generate", *task[:2], "--policy", "x:y")
    assert "--import MODULE" in capfd.readouterr().err
    irl("demos", "generate", *task, "--episodes", 3, "--policy", f"{theirs}:act", "--dataset-id", "irl/t-v0")
    irl("train", "gail", *task, "--demos", "irl/t-v0", "--demo-episodes", 2, "--out", "run", *QUICK)
    config = json.loads(Path("run/config.json").read_text())
    assert (config["env_id"], config["env_kwargs"]) == ('Theirs-v0?{"cliff":1.2}', [])
    irl("evaluate", "run", *LOOK)
    irl("train", "--resume", "run")
    # another process does not know the task, until it is named again
    monkeypatch.delitem(gym.registry, "Theirs-v0")
    monkeypatch.delitem(sys.modules, theirs)
    with pytest.raises(SystemExit):
        irl("evaluate", "run", *LOOK)
    assert "--import MODULE" in capfd.readouterr().err
    irl("evaluate", "run", *LOOK, f"--import={theirs}")


def test_a_process_that_a_command_starts_knows_the_task(
    irl: Command, theirs: str, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    policy = home / "policies" / "pointmass" / "expert" / "policy.safetensors"
    child = (*PROGRAM, "demos", "generate", "--env-id", "Theirs-v0", "--policy", str(policy))
    child += ("--episodes", "1", "--dataset-id", "irl/t-v0", "--datasets-root", "ds")
    ended: list[int] = []

    def start(command: object) -> None:
        ended.append(Processes().run(child, Path("log")))

    monkeypatch.setitem(COMMANDS, ("metrics",), (COMMANDS["metrics",][0], start))
    irl("metrics")
    assert "--import MODULE" in Path("log").read_text()
    irl("metrics", "--import", theirs)
    assert ended == [2, 0], Path("log").read_text()
    # what comes after in this process has not typed it
    assert VARIABLE not in os.environ


def test_arguments_change_the_task_that_is_trained_in(irl: Command) -> None:
    irl("train", "gail", "--env-id", TASK, "--env-kwargs", '{"cliff": 0.05}', "--out", "run", *QUICK,
        "--demos", "irl/pointmass/expert-v0")  # fmt: skip
    irl("evaluate", "run", *LOOK, "--episodes", 3)
    assert json.loads(Path("run/evaluation.json").read_text())["policy"]["length_min"] < 30


@pytest.mark.parametrize("inputs", ["obs", "obs_next_obs"])
def test_demonstrations_without_actions(inputs: str, irl: Command, capfd: pytest.CaptureFixture) -> None:
    arrays = flat(pointmass.demonstrations(4))
    write_npz(Path("states.npz"), {k: v for k, v in arrays.items() if k not in ("actions", "rewards")})
    irl("demos", "import", "states.npz", "--env-id", TASK, "--name", "irl/states-v0", "--datasets-root", "ds")
    words = ("train", "gail", "--env-id", TASK, "--demos", "irl/states-v0", "--datasets-root", "ds", *QUICK)
    with pytest.raises(SystemExit):
        irl(*words, "--demo-episodes=3", "--out", "refused")
    assert "have no actions" in (said := capfd.readouterr().err)
    assert "--discriminator.inputs obs" in said
    with pytest.raises(SystemExit):
        # whatever g sees, log pi is of the actions
        irl(
            "train", "airl", *words[2:], "--demo-episodes=3", "--discriminator.inputs=obs", "--out", "refused"
        )
    assert "have no actions" in capfd.readouterr().err
    seen = (f"--discriminator.inputs={inputs}", "--schedule.expert-share=0.25", "--out=refused")
    with pytest.raises(SystemExit):
        # a learner of states and actions learns from them too
        irl("train", "gail-sac", *words[2:8], "--demo-episodes=3", *seen)
    assert "(expert-share)" in capfd.readouterr().err
    irl(*words, "--demo-episodes=3", "--discriminator.inputs", inputs, "--out", "run")
    irl("evaluate", "run", *LOOK)
    found = json.loads(Path("run/evaluation.json").read_text())
    assert found["reward"]["auroc"] is not None
    assert found["references"]["demonstrations"]["return_mean"] is None
    reward = load_reward(Path("run"))
    assert (reward.spec.net.sees, reward.spec.net.action_dim) == (inputs, 2)
    irl("train", "--resume", "run")


class InParts(gym.ObservationWrapper):
    """The point mass with its place in a dictionary, beside a number that is no observation."""

    def __init__(self) -> None:
        super().__init__(gym.make(TASK))
        self.observation_space = Dict({"place": Box(-1.5, 1.5, (2,), np.float64), "mode": Discrete(2)})

    def observation(self, observation: np.ndarray) -> dict:
        return {"place": observation, "mode": 0}


@pytest.fixture
def parts(irl: Command, monkeypatch: pytest.MonkeyPatch) -> list[Episode]:
    """The episodes of two datasets in ds, parts-v0 and again-v0, whose observations are in a dictionary."""
    spec = EnvSpec("InParts-v0", lambda **_: InParts(), disable_env_checker=True)
    monkeypatch.setitem(gym.registry, "InParts-v0", spec)
    episodes = pointmass.demonstrations(3)
    buffers = [
        buffer(None, {"place": e.obs, "mode": np.zeros(len(e.obs), np.int64)}, e.action) for e in episodes
    ]
    spaces = {"observation_space": InParts().observation_space, "action_space": Box(-1, 1, (2,))}
    for name in ("parts-v0", "again-v0"):
        written(Path("ds").resolve(), name, buffers, "hdf5", **spaces)
    return episodes


class Mirrored(gym.ObservationWrapper):
    """The point mass with its place in a dictionary, and beside it the place in a mirror."""

    def __init__(self) -> None:
        super().__init__(gym.make(TASK))
        box = Box(-1.5, 1.5, (2,), np.float64)
        self.observation_space = Dict({"place": box, "mirrored": box})

    def observation(self, observation: np.ndarray) -> dict:
        return {"place": observation, "mirrored": -observation}


def test_demonstrations_of_other_parts_of_an_observation_are_refused(
    irl: Command, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    spec = EnvSpec("Mirrored-v0", lambda **_: Mirrored(), disable_env_checker=True)
    monkeypatch.setitem(gym.registry, "Mirrored-v0", spec)
    for part in ("place", "mirrored"):
        words = {"dataset_id": f"{part}-v0", "root": "ds", "seeds": range(3), "description": ""}
        task = full_name("Mirrored-v0", (f"obs_keys={part}",))
        generate(
            task, pointmass.expert(), algorithm="", author="", random_return=None, expert_return=None, **words
        )
    task = ("--env-id", "Mirrored-v0", "--env-kwargs")
    irl("train", "gail", *task, "obs_keys=place", "--demos", "place-v0", *INTO_RUN)
    assert "where that is not meant" not in capfd.readouterr().err
    for words in (
        ("train", "gail", *task, "obs_keys=mirrored", "--demos", "place-v0", *INTO_RUN[:-1], "--out=other"),
        ("demos", "merge", "place-v0", "mirrored-v0", "--into", "both-v0", "--datasets-root", "ds"),
    ):
        with pytest.raises(SystemExit):
            irl(*words)
        assert re.search("other parts of the observations|of one task", capfd.readouterr().err)
    assert not Path("other").exists()


INTO_RUN = ("--datasets-root", "ds", "--demo-episodes=2", "--out", "run", *QUICK)


@pytest.mark.usefixtures("parts")
@pytest.mark.parametrize("keys", ['{"obs_keys": ["place"]}', "obs_keys=place"])
def test_parts_of_observations_in_a_dictionary_are_learned_from(keys: str, irl: Command) -> None:
    task = ("--env-id", "InParts-v0", "--env-kwargs", keys)
    irl("train", "gail", *task, "--demos", "parts-v0", *INTO_RUN)
    irl("evaluate", "run", *LOOK)
    assert load_reward(Path("run")).spec.net.obs_dim == 2


def test_parts_of_observations_in_a_dictionary_are_shown_split_and_merged(
    irl: Command, parts: list[Episode], capfd: pytest.CaptureFixture
) -> None:
    keys = ("--datasets-root", "ds", "--obs-keys", "place")
    irl("demos", "show", "parts-v0", *keys)
    assert "3 of 30 to 30 steps" in capfd.readouterr().out
    irl("demos", "split", "parts-v0", "--into", "a-v0", "b-v0", *keys)
    irl("demos", "merge", "parts-v0", "again-v0", "--into", "c-v0", *keys)
    # what is in a row now says of which parts, so that it is not taken for others
    named = replace(open_dataset("parts-v0", "ds", ("place",)), env_spec='{"id": "InParts-v0"}')
    _write_part(named, parts, "e-v0", Path("ds/e-v0").resolve(), "ds", "")
    assert open_dataset("e-v0", "ds").env_name == 'InParts-v0?{"obs_keys":["place"]}'
    # in a row from then on
    assert [len(load_demos(name, root="ds")) for name in ("a-v0", "b-v0", "c-v0")] == [2, 1, 6]
    for found, made in zip(load_demos("c-v0", root="ds"), parts * 2, strict=True):
        np.testing.assert_array_equal(found.obs, made.obs)
    for words, said in (
        (("show", "parts-v0", *keys[:2]), "--obs-keys mode place"),
        (("show", "parts-v0", *keys, "speed"), "no real numbers 'speed'"),
        (("show", "c-v0", *keys), "obs_keys is for those in a Dict"),
        (("merge", "parts-v0", "c-v0", "--into", "d-v0", *keys[:2]), "--obs-keys mode place"),
        (("split", "parts-v0", *keys, "mode"), "no real numbers 'mode'"),
    ):
        with pytest.raises(SystemExit):
            irl("demos", *words)
        assert said in capfd.readouterr().err


def test_demonstrations_of_a_variant_are_learned_from_with_a_word(
    irl: Command, home: Path, tmp_path: Path, capfd: pytest.CaptureFixture
) -> None:
    expert, root = (
        home / "policies" / "pointmass" / "expert" / "policy.safetensors",
        ("--datasets-root", "ds"),
    )
    one = ("--env-id", TASK, "--env-kwargs", "good=3", "--policy", expert, "--episodes", "2")
    irl("demos", "generate", *one, "--dataset-id", "near-v0", *root)
    assert 'PointMass-v0?{"good":3}' in capfd.readouterr().out
    near = ("train", "bc", "--env-id", TASK, "--demos", "near-v0", "--demo-episodes=1", "--steps=2", *root)
    said = (
        f'irl: demonstrations near-v0 are of {TASK}?{{"good":3}}, training is in {TASK}; where that is not '
        f"meant, name the demonstrations' arguments with --env-kwargs"
    )
    irl(*near, "--out", "plain")
    assert capfd.readouterr().err.splitlines().count(said) == 1
    irl(*near, "--env-kwargs", "good=3", "--out", "same")
    assert "irl: " not in capfd.readouterr().err
