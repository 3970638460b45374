"""Finding datasets, and refusing those that cannot be used."""

import json

import h5py
import numpy as np
import pytest

from irl.core.errors import UserError
from irl.demos.load import load_demos
from irl.demos.storage import generate_command, list_datasets
from tests.demos.conftest import foreign


def test_list(make_hopper, tmp_path):
    assert list_datasets(tmp_path) == list_datasets(tmp_path / "nowhere") == []
    make_hopper("b-v0")
    make_hopper("irl/hopper/a-v0")
    hidden = tmp_path / "irl" / ".x" / "data"
    hidden.mkdir(parents=True)
    (hidden / "metadata.json").touch()
    assert list_datasets(tmp_path) == ["b-v0", "irl/hopper/a-v0"]
    assert list_datasets(str(tmp_path)) == ["b-v0", "irl/hopper/a-v0"]


def test_not_found_says_what_is_and_how_to_make_it(make_hopper, tmp_path, monkeypatch):
    make_hopper()
    with pytest.raises(UserError) as caught:
        load_demos("irl/walker2d/expert-v0", root=tmp_path)
    assert str(caught.value) == (
        f"no dataset 'irl/walker2d/expert-v0' in {tmp_path}; there: irl/hopper/random-v0; make it with "
        f"`irl demos generate --env-id Walker2d-v5 --dataset-id irl/walker2d/expert-v0 "
        f"--datasets-root {tmp_path}`"
    )
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "empty"))
    with pytest.raises(UserError, match=r"there: none; .*--env-id ENV_ID --dataset-id other-v1`"):
        load_demos("other-v1")
    assert not (tmp_path / "empty").exists()


def test_the_command_names_no_root_that_was_not_given():
    assert generate_command("irl/hopper/expert-v0") == (
        "irl demos generate --env-id Hopper-v5 --dataset-id irl/hopper/expert-v0"
    )
    assert generate_command("a-v0", "/a b").endswith("--datasets-root '/a b'")


@pytest.mark.parametrize("dataset_id", ["irl/hopper", "../x-v0"])
def test_not_an_id(tmp_path, dataset_id):
    with pytest.raises(UserError, match="is not a dataset id"):
        load_demos(dataset_id, root=tmp_path)


def test_damaged_files(make_hopper, tmp_path):
    path = make_hopper().path / "data"

    def refused(message: str) -> None:
        with pytest.raises(UserError, match=message) as caught:
            load_demos("irl/hopper/random-v0", root=tmp_path)
        assert "\n" not in str(caught.value)

    with h5py.File(path / "main_data.hdf5", "a") as file:
        del file["episode_3/actions"]
    refused("cannot be read: main_data.hdf5 has sha256 .* take irl_data_sha256 out of metadata.json")
    foreign(path)
    refused("irl/hopper/random-v0 in .* cannot be read: .*actions.*; make it again with .* --overwrite`$")
    content = (path / "main_data.hdf5").read_bytes()
    (path / "main_data.hdf5").write_bytes(content[: len(content) // 2])
    refused("cannot be read")
    metadata = json.loads((path / "metadata.json").read_text())
    (path / "metadata.json").write_text(json.dumps(metadata | {"minari_version": "9.9.9"}))
    refused("cannot be read: .*9.9.9")
    (path / "metadata.json").write_text("{")
    refused("cannot be read")
    (path / "metadata.json").unlink()
    refused("cannot be read")


def test_spaces_that_are_not_flat_boxes(make_hopper, tmp_path):
    path = make_hopper().path / "data" / "metadata.json"
    metadata = json.loads(path.read_text())
    discrete = json.dumps({"type": "Discrete", "dtype": "int64", "start": 0, "n": 2})
    path.write_text(json.dumps(metadata | {"action_space": discrete}))
    with pytest.raises(UserError, match=r"episode 0 has actions of float32; expected whole numbers"):
        load_demos("irl/hopper/random-v0", root=tmp_path)


def test_infos_of_other_recorders(make_hopper, tmp_path):
    """Without the row of the reset, with vectors, with text, and with a term missing."""
    path = make_hopper().path / "data" / "main_data.hdf5"
    foreign(path.parent)
    with h5py.File(path, "a") as file:
        infos = file["episode_0/infos"]
        assert isinstance(infos, h5py.Group)
        x = np.asarray(infos["x_position"])
        del infos["x_position"], infos["reward_survive"]
        infos["x_position"] = x[1:]
        infos["qpos"] = np.zeros((len(x), 6))
        infos["short"] = x[:3]
        infos["text"] = np.array([b"a"] * len(x))
        infos.create_group("nested")
    demos = load_demos("irl/hopper/random-v0", root=tmp_path)
    assert demos[0].terms == {}
    assert set(demos[0].infos) == {
        "reward_forward",
        "reward_ctrl",
        "x_position",
        "x_velocity",
        "z_distance_from_origin",
    }
    np.testing.assert_array_equal(demos[0].infos["x_position"], x[1:])
    assert set(demos[1].terms) == {"forward", "ctrl", "survive"}


def test_an_episode_cut_off_by_the_recording(make_hopper, tmp_path):
    path = make_hopper().path / "data" / "main_data.hdf5"
    foreign(path.parent)
    with h5py.File(path, "a") as file:
        file["episode_0/terminations"][...] = False  # pyright: ignore[reportIndexIssue]
    demos = load_demos("irl/hopper/random-v0", root=tmp_path)
    assert (demos[0].terminated, demos[0].truncated) == (False, True)
