"""Numbers of a step come back under the `info` keys they had, whatever HDF5 makes of a `/`."""

from collections.abc import Callable
from pathlib import Path

import gymnasium as gym
import h5py
import minari
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box
from hypothesis import given
from hypothesis import strategies as st

from irl.core.errors import UserError
from irl.demos.curate import merge
from irl.demos.generate import generate
from irl.demos.hdf5 import key_of, stored_key
from irl.demos.info import show
from irl.demos.load import load_demos
from irl.demos.root import minari_at
from tests.demos.conftest import foreign

Record = Callable[[dict[str, float]], None]


class Told(gym.Env):
    """Three steps; the n-th says n times each of the numbers it is given."""

    observation_space = Box(-1.0, 1.0, (2,), np.float64)
    action_space = Box(-1.0, 1.0, (1,))

    def __init__(self, numbers: dict[str, float]) -> None:
        self._numbers = numbers

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._n = 0
        return np.zeros(2), dict(self._numbers)

    def step(self, action):
        self._n += 1
        return np.zeros(2), 0.0, False, False, {key: self._n * v for key, v in self._numbers.items()}


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Record:
    """Write a dataset told-v0 of an environment whose info has those numbers."""

    def run(numbers: dict[str, float]) -> None:
        spec = EnvSpec("Told-v0", lambda **_: Told(numbers), max_episode_steps=3, disable_env_checker=True)
        monkeypatch.setitem(gym.registry, "Told-v0", spec)
        words = {"algorithm": "a", "author": "b", "description": "", "random_return": 0.0}
        where = {"dataset_id": "told-v0", "root": tmp_path, "seeds": [0]}
        generate("Told-v0", lambda obs: np.zeros(1), expert_return=1.0, **where, **words)

    return run


NUMBERS = {"r": 1.0, "r/x": 2.0, "r/x/y": 3.0, "a/b": 4.0, "/": 5.0, "c//d/": 6.0, "50%": 7.0, "e%2Ff": 8.0}


def test_a_key_with_a_slash_comes_back(record: Record, tmp_path: Path) -> None:
    record(NUMBERS)
    (episode,) = load_demos("told-v0", root=tmp_path)
    assert {key: values.tolist() for key, values in episode.infos.items()} == {
        key: [value, 2 * value, 3 * value] for key, value in NUMBERS.items()
    }
    assert set(show("told-v0", tmp_path).infos) == set(NUMBERS)


def test_minari_reads_them_and_a_copy_has_them(record: Record, tmp_path: Path) -> None:
    record({"r": 1.0, "r/x": 2.0})
    with minari_at(tmp_path):
        (data,) = minari.load_dataset("told-v0").iterate_episodes()
    assert data.infos.keys() == {"r", "r%2Fx"}
    np.testing.assert_array_equal(data.infos["r%2Fx"], [2.0, 2.0, 4.0, 6.0])
    (tmp_path / "told-v0").rename(tmp_path / "first-v0")
    record({"r": 1.0, "r/x": 2.0})
    merge(["first-v0", "told-v0"], "both-v0", root=tmp_path)
    assert [set(episode.infos) for episode in load_demos("both-v0", root=tmp_path)] == [{"r", "r/x"}] * 2


def test_numbers_that_lie_in_groups_are_read(record: Record, tmp_path: Path) -> None:
    record({"r": 1.0})
    foreign(tmp_path / "told-v0" / "data")
    with h5py.File(tmp_path / "told-v0" / "data" / "main_data.hdf5", "a") as file:
        infos = file["episode_0/infos"]
        assert isinstance(infos, h5py.Group)
        infos["a/b"] = np.arange(4.0)
        infos["a/deeper/c"] = np.arange(4.0)
        # a group that holds itself is not gone through for ever
        infos["a/around"] = infos["a"]
    (episode,) = load_demos("told-v0", root=tmp_path)
    assert set(episode.infos) == {"r", "a/b", "a/deeper/c"}
    np.testing.assert_array_equal(episode.infos["a/b"], [1.0, 2.0, 3.0])


@given(st.text(st.sampled_from("%25F/a"), min_size=1, max_size=12))
def test_every_key_has_a_name_of_its_own(key: str) -> None:
    assert "/" not in stored_key(key)
    assert key_of(stored_key(key)) == key


@pytest.mark.parametrize("key", [0, "", ".", "a\0b"])
def test_what_hdf5_cannot_name_is_refused(key: object) -> None:
    with pytest.raises(UserError, match=r"the info has the key .*; expected text") as caught:
        stored_key(key)
    assert repr(key) in str(caught.value)
