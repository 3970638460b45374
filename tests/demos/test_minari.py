"""Datasets that Minari's own tools wrote, in each of its formats, whatever they are called."""

import gc
from pathlib import Path

import gymnasium as gym
import minari
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Dict, Discrete
from minari import DataCollector
from minari.data_collector import EpisodeBuffer

from irl.core.errors import UserError
from irl.demos.generate import generate
from irl.demos.info import show
from irl.demos.load import load_demos
from irl.demos.root import minari_at

NAMES = ("short-v0", "D4RL/Hopper_v5/Expert-v12", "a/b/c/d-v3")
FORMATS = ["hdf5", pytest.param("arrow", id="arrow"), pytest.param("parquet", id="parquet")]


def written(root: Path, dataset_id: str, buffers: list[EpisodeBuffer], form: str, **more) -> None:
    with minari_at(root):
        minari.create_dataset_from_buffers(dataset_id, buffers, data_format=form, **more)


def buffer(seed: int | None, observations, actions, infos=None) -> EpisodeBuffer:
    n = len(actions)
    ends = np.arange(n) == n - 1
    return EpisodeBuffer(
        seed=seed,
        observations=observations,
        actions=actions,
        rewards=np.arange(float(n)),  # pyright: ignore[reportArgumentType]
        terminations=ends,  # pyright: ignore[reportArgumentType]
        truncations=~ends & ends,  # pyright: ignore[reportArgumentType]
        infos=infos,
    )


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("dataset_id", NAMES)
def test_every_format_and_name(form, dataset_id, tmp_path) -> None:
    rng = np.random.default_rng(0)
    obs = [rng.normal(size=(n + 1, 3)) for n in (4, 6)]
    acts = [rng.uniform(-1, 1, size=(n, 2)).astype(np.float32) for n in (4, 6)]
    infos = {"x": np.arange(7.0), "nested": {"y": np.zeros(7)}, "vector": np.zeros((7, 2))}
    buffers = [buffer(5, obs[0], acts[0]), buffer(None, obs[1], acts[1], infos)]
    spaces = {"observation_space": Box(-9, 9, (3,), np.float64), "action_space": Box(-1, 1, (2,))}
    if form != "hdf5":
        # Arrow's own reader wants the same infos of every episode
        buffers = [buffer(5, obs[0], acts[0]), buffer(None, obs[1], acts[1])]
    written(tmp_path, dataset_id, buffers, form, **spaces)
    demos = load_demos(dataset_id, root=tmp_path)
    assert demos.env_id is None
    for episode, o, a in zip(demos, obs, acts, strict=True):
        np.testing.assert_array_equal(episode.obs, o)
        np.testing.assert_array_equal(episode.action, a)
        np.testing.assert_array_equal(episode.reward, np.arange(len(a)))
        assert (episode.terminated, episode.truncated) == (True, False)
    assert [e.seed for e in demos] == [5, None]
    if form == "hdf5":
        assert set(demos[1].infos) == {"x", "nested/y"}
        np.testing.assert_array_equal(demos[1].infos["x"], np.arange(1.0, 7.0))


@pytest.mark.parametrize("form", FORMATS)
def test_choices(form, tmp_path) -> None:
    spaces = {"observation_space": Box(-9, 9, (1,), np.float64), "action_space": Discrete(3, start=1)}
    written(tmp_path, "a-v0", [buffer(0, np.zeros((4, 1)), np.array([3, 1, 2]))], form, **spaces)
    np.testing.assert_array_equal(
        load_demos("a-v0", root=tmp_path)[0].action, [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    )


@pytest.mark.parametrize("form", FORMATS)
def test_parts_of_a_dictionary(form, tmp_path) -> None:
    parts = {"goal": np.ones((3, 2)), "place": np.arange(12.0).reshape(3, 4), "step": np.arange(3)}
    space = Dict({"goal": Box(-2, 2, (2,)), "place": Box(-99, 99, (4,), np.float64), "step": Discrete(9)})
    if form == "hdf5":
        space["place"] = Box(-99, 99, (2, 2), np.float64)
        parts["place"] = parts["place"].reshape(3, 2, 2)
    parts["goal"] = parts["goal"].astype(np.float32)
    spaces = {"observation_space": space, "action_space": Box(-1, 1, (1,))}
    written(tmp_path, "a-v0", [buffer(0, parts, np.zeros((2, 1), np.float32))], form, **spaces)
    demos = load_demos("a-v0", root=tmp_path, obs_keys=("place", "goal"))
    expected = np.concatenate([np.arange(12.0).reshape(3, 4), np.ones((3, 2))], axis=1)
    np.testing.assert_array_equal(demos[0].obs, expected)
    with pytest.raises(UserError, match=r"name the parts .*obs_keys="):
        load_demos("a-v0", root=tmp_path)
    # one name may stand alone, as in a task's name
    assert load_demos("a-v0", root=tmp_path, obs_keys="goal")[0].obs.shape == (3, 2)
    for wrong in ("step", "speed"):
        with pytest.raises(UserError, match=f"no real numbers '{wrong}'"):
            load_demos("a-v0", root=tmp_path, obs_keys=(wrong,))


def test_arrow_without_pyarrow_says_what_to_install(tmp_path, monkeypatch) -> None:
    spaces = {"observation_space": Box(-9, 9, (1,)), "action_space": Box(-1, 1, (1,))}
    zeros = np.zeros((3, 1), np.float32)
    written(tmp_path, "a-v0", [buffer(0, zeros, zeros[1:])], "arrow", **spaces)
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(UserError, match=r"dataset a-v0 in .*pip install pyarrow"):
        load_demos("a-v0", root=tmp_path)


def test_a_damaged_arrow_dataset_is_one_line(tmp_path) -> None:
    spaces = {"observation_space": Box(-9, 9, (1,)), "action_space": Box(-1, 1, (1,))}
    zeros = np.zeros((3, 1), np.float32)
    written(tmp_path, "a-v0", [buffer(0, zeros, zeros[1:])], "arrow", **spaces)
    (part,) = (tmp_path / "a-v0" / "data" / "0").glob("*.arrow")
    content = part.read_bytes()
    for damage in (b"", content[: len(content) // 2], b"hello" * 100):
        part.write_bytes(damage)
        with pytest.raises(UserError, match=r"dataset a-v0 in .* cannot be read") as caught:
            load_demos("a-v0", root=tmp_path)
        assert "\n" not in str(caught.value)
    part.unlink()
    with pytest.raises(UserError, match="no file"):
        load_demos("a-v0", root=tmp_path)


# Minari leaves its temporary folder to be found by the garbage collector
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("env_id", ["CartPole-v1", "InvertedPendulum-v5"])
@pytest.mark.parametrize("form", FORMATS)
def test_what_minaris_own_collector_wrote(env_id, form, tmp_path) -> None:
    with minari_at(tmp_path):
        # with infos, Minari wants every key of a step from the reset too, which MuJoCo's tasks do not tell
        env = DataCollector(gym.make(env_id), record_infos=env_id == "CartPole-v1", data_format=form)
        env.action_space.seed(0)
        steps = []
        for seed in range(3):
            env.reset(seed=seed)
            ended, n = False, 0
            while not ended:
                _, _, terminated, truncated, _ = env.step(env.action_space.sample())
                ended, n = terminated or truncated, n + 1
            steps.append(n)
        env.create_dataset("Own/collected-v0", algorithm_name="random")
        env.close()
        del env
        gc.collect()
    demos = load_demos("Own/collected-v0", root=tmp_path)
    assert [len(e) for e in demos] == steps
    assert [e.seed for e in demos] == [0, 1, 2]
    assert all(e.terminated for e in demos)
    assert demos.env_id == env_id
    assert show("Own/collected-v0", tmp_path).action_size == {"CartPole-v1": 2}.get(env_id, 1)


class Bare(gym.Env):
    """An environment that Gymnasium cannot write down."""

    observation_space = Box(-1.0, 1.0, (2,), np.float64)
    action_space = Box(-1.0, 1.0, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(2), {}

    def step(self, action):
        return np.zeros(2), 0.0, False, False, {}


def test_an_environment_registered_as_a_function(tmp_path, monkeypatch) -> None:
    spec = EnvSpec("Bare-v0", lambda **_: Bare(), max_episode_steps=5, disable_env_checker=True)
    monkeypatch.setitem(gym.registry, "Bare-v0", spec)
    words = {"algorithm": "a", "author": "b", "random_return": 0.0, "expert_return": 1.0, "description": ""}
    info = generate("Bare-v0", lambda obs: np.zeros(1), dataset_id="a-v0", root=tmp_path, seeds=[0], **words)
    assert (info.env_id, info.steps) == ("Bare-v0", 5)
    assert load_demos("a-v0", root=tmp_path).env_id == "Bare-v0"
    with minari_at(tmp_path):
        assert len(list(minari.load_dataset("a-v0").iterate_episodes())) == 1
