"""A generated dataset is Minari's, whole, and the same for the same seeds."""

import json
from pathlib import Path

import h5py
import minari
import numpy as np
import pytest
from minari.namespace import list_local_namespaces

from irl.core.errors import UserError
from irl.core.types import ActFn
from irl.demos import write as module
from irl.demos.generate import generate
from irl.demos.info import show
from irl.envs.make import make
from irl.envs.rollouts import random_act, record

KEYS = {
    "reward_forward",
    "reward_ctrl",
    "reward_survive",
    "x_position",
    "z_distance_from_origin",
    "x_velocity",
}


def arrays(path: Path) -> dict[str, np.ndarray]:
    found: dict[str, np.ndarray] = {}

    def keep(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item[()]

    with h5py.File(path / "data" / "main_data.hdf5") as file:
        file.visititems(keep)
    return found


def replay(actions: np.ndarray) -> ActFn:
    remaining = iter(actions)

    def act(obs: np.ndarray) -> np.ndarray:
        return next(remaining)

    return act


def files_of(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_what_was_made_is_what_is_shown(make_hopper, tmp_path):
    heard = []
    info = make_hopper(on_episode=heard.append)
    assert info == show("irl/hopper/random-v0", tmp_path)
    assert (info.dataset_id, info.env_id, info.path) == (
        "irl/hopper/random-v0",
        "Hopper-v5",
        tmp_path / "irl/hopper/random-v0",
    )
    assert (info.episodes, info.steps) == (5, sum(len(e) for e in heard))
    assert info.return_mean == pytest.approx(np.mean([e.return_ for e in heard]), abs=1e-12)
    assert info.return_std == pytest.approx(np.std([e.return_ for e in heard]), abs=1e-12)
    assert (info.length_min, info.length_max) == (min(map(len, heard)), max(map(len, heard)))
    assert set(info.terms) == {"forward", "ctrl", "survive"}
    assert set(info.infos) == {"x_position", "z_distance_from_origin", "x_velocity"}
    assert info.seeds == (11, 12, 13, 14, 15)
    assert (info.algorithm, info.author, info.description) == ("random", "somebody", "a test")
    assert (info.random_return, info.expert_return) == (20.0, 120.0)
    assert info.size_bytes == sum(f.stat().st_size for f in info.path.rglob("*") if f.is_file())


def test_minari_reads_it(make_hopper, tmp_path, monkeypatch):
    make_hopper()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    assert list(minari.list_local_datasets()) == ["irl/hopper/random-v0"]
    assert list_local_namespaces() == ["irl", "irl/hopper"]
    dataset = minari.load_dataset("irl/hopper/random-v0")
    returns = np.array([20.0, 120.0, 70.0])
    np.testing.assert_allclose(minari.get_normalized_score(dataset, returns), [0, 1, 0.5])
    env = dataset.recover_environment()
    assert env.spec is not None
    assert env.spec.id == "Hopper-v5"
    for data, metadata in zip(
        dataset.iterate_episodes(), dataset.storage.get_episode_metadata(range(5)), strict=True
    ):
        live, at_reset = record(env, replay(data.actions), metadata["seed"])
        np.testing.assert_array_equal(data.observations, live.obs)
        np.testing.assert_array_equal(data.rewards, live.reward)
        assert data.infos.keys() == KEYS
        np.testing.assert_array_equal(data.infos["reward_ctrl"], np.r_[0, live.terms["ctrl"]])
        np.testing.assert_array_equal(
            data.infos["x_position"], np.r_[at_reset["x_position"], live.infos["x_position"]]
        )
        # the reset does not tell a velocity
        assert np.isnan(data.infos["x_velocity"][0])
        assert np.isfinite(data.infos["x_velocity"][1:]).all()
        assert metadata["rewards_sum"] == live.return_
    env.close()
    content = json.loads((tmp_path / "irl/hopper/random-v0/data/metadata.json").read_text())
    assert {r.split("==")[0] for r in content["requirements"]} == {"gymnasium", "mujoco"}


def test_same_seeds_same_arrays(make_hopper):
    first, again = arrays(make_hopper().path), arrays(make_hopper("irl/hopper/again-v0").path)
    other = arrays(make_hopper("irl/hopper/other-v0", seeds=[1, 2, 3, 4, 5]).path)
    assert len(first) == 5 * (5 + len(KEYS))
    for name, values in first.items():
        np.testing.assert_array_equal(values, again[name], err_msg=name)
    assert first["episode_0/observations"][0, 0] != other["episode_0/observations"][0, 0]


def test_a_task_outside_the_table(tmp_path):
    env = make("Pendulum-v1")
    act = random_act(env.action_space, np.random.default_rng(0))
    env.close()
    info = generate(
        "Pendulum-v1",
        act,
        dataset_id="pendulum-v0",
        root=tmp_path,
        seeds=[0],
        algorithm="random",
        author="somebody",
        random_return=-1200.0,
        expert_return=-150.0,
        description="a test",
    )
    assert (info.terms, info.infos, info.steps) == ((), (), 200)


def test_is_not_overwritten_unless_asked(make_hopper, tmp_path):
    before = arrays(make_hopper().path)
    with pytest.raises(UserError, match="irl/hopper/random-v0 is already in"):
        make_hopper(seeds=[1])
    assert arrays(tmp_path / "irl/hopper/random-v0").keys() == before.keys()
    assert make_hopper(seeds=[1], overwrite=True).seeds == (1,)


def test_a_folder_of_datasets_is_not_overwritten(make_hopper, tmp_path):
    make_hopper("irl/hopper-v0/random-v0")
    with pytest.raises(UserError, match="is not a dataset"):
        make_hopper("irl/hopper-v0", overwrite=True)
    assert show("irl/hopper-v0/random-v0", tmp_path).episodes == 5


@pytest.mark.parametrize(
    "dataset_id", ["irl/hopper", "", "../hopper-v0", "/hopper-v0", "a b-v0", "irl//hopper-v0"]
)
def test_ids_that_minari_does_not_take(make_hopper, tmp_path, dataset_id):
    with pytest.raises(UserError, match="is not a dataset id"):
        make_hopper(dataset_id)
    assert list(tmp_path.iterdir()) == []


def test_no_seeds_and_no_environment(make_hopper):
    with pytest.raises(UserError, match="at least one episode"):
        make_hopper(seeds=[])
    with pytest.raises(UserError, match="Hopper-v5"):
        generate(
            "Hoper-v5",
            lambda obs: np.zeros(3),
            dataset_id="irl/hopper/x-v0",
            seeds=[0],
            algorithm="",
            author="",
            random_return=0.0,
            expert_return=1.0,
            description="",
        )


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_failure_leaves_what_was_there(make_hopper, tmp_path, monkeypatch, overwrite):
    if overwrite:
        make_hopper()
    before = files_of(tmp_path)
    create = minari.create_dataset_from_buffers

    class OnFire(Exception):
        pass

    def fail(*args, **kwargs):
        create(*args, **kwargs)
        raise OnFire

    monkeypatch.setattr(module.minari, "create_dataset_from_buffers", fail)
    with pytest.raises(OnFire):
        make_hopper(seeds=[1], overwrite=overwrite)
    assert files_of(tmp_path) == before


def test_a_root_that_cannot_be(make_hopper, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match="cannot write"):
        make_hopper(root=tmp_path / "file")


def test_nothing_is_printed(make_hopper, capfd):
    make_hopper()
    assert capfd.readouterr() == ("", "")
