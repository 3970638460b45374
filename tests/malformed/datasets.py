"""Datasets that cannot be used. `irl demos show` unless another command is named."""

import json
from pathlib import Path

import h5py
import numpy as np

from tests.experiment.conftest import DATASET, TASK
from tests.malformed.damage import (
    Damage,
    a_folder,
    being,
    column,
    cut,
    empty,
    flipped,
    gone,
    hdf5,
    keyed,
    number,
    raw,
    space,
    void,
)
from tests.malformed.table import DATA, Case, at

AGAIN = ("cannot be read", "make it again with `irl demos generate", "--overwrite")
TRAIN = f"train gail --env-id {TASK} --out new"
BOX = {"type": "Box", "dtype": "float32", "shape": [2], "low": [-1.0, -1.0], "high": [1.0, 1.0]}
IMAGE = np.zeros((8, 8, 3)).tolist()


def data(damage: Damage, *named: str, words: str = f"demos show {DATASET}") -> Case:
    return Case(words, named, at(DATA, damage))


def metadata(damage: Damage, *named: str) -> Case:
    return data(lambda folder: damage(folder / "metadata.json"), DATASET, *named, *AGAIN)


def raw_data(damage: Damage, *named: str) -> Case:
    return data(raw(damage), DATASET, *named, *AGAIN)


def another_version(path: Path) -> None:
    content = bytearray(path.read_bytes())
    # the byte after the signature is the version of the superblock
    content[8] = 99
    path.write_bytes(content)


def elsewhere(file: h5py.File) -> None:
    del file["episode_2/rewards"]
    file["episode_2/rewards"] = h5py.ExternalLink("/etc/other.hdf5", "/rewards")


def outside(file: h5py.File) -> None:
    del file["episode_2/rewards"]
    file.create_dataset("episode_2/rewards", (30,), "f8", external=[("/etc/hostname", 0, 240)])


def endless(file: h5py.File) -> None:
    file.create_dataset("episode_2/infos/more", (2**40,), "f8", chunks=(2**20,))


def dangling(file: h5py.File) -> None:
    del file["episode_2/actions"]
    file["episode_2/actions"] = h5py.SoftLink("/nowhere")


def no_steps(file: h5py.File) -> None:
    for name in ("observations", "actions", "rewards", "terminations", "truncations"):
        del file[f"episode_2/{name}"]
        file[f"episode_2/{name}"] = np.zeros((0, 2) if name in ("observations", "actions") else 0)


def early_end(file: h5py.File) -> None:
    void(file["episode_2/terminations"].__setitem__(7, True))  # pyright: ignore[reportAttributeAccessIssue]


def no_space(path: Path) -> None:
    spec = {
        "id": TASK,
        "entry_point": "os:system",
        "kwargs": {"command": "touch ran"},
        "additional_wrappers": [],
    }
    keyed(observation_space=..., env_spec=json.dumps(spec))(path)


FILES = {
    "empty data": raw_data(empty, "signature"),
    "data cut off": raw_data(cut, "truncated file"),
    "data that are text": raw_data(being("hello" * 1000), "signature"),
    "data of an unknown version": raw_data(another_version, "superblock"),
    "data of one other byte": data(lambda f: flipped(f / "main_data.hdf5"), "sha256", *AGAIN),
    "data empty, with their digest": data(lambda f: empty(f / "main_data.hdf5"), "sha256", *AGAIN),
    "no data": raw_data(gone, "no file", "main_data.hdf5"),
    "data that are a folder": raw_data(a_folder, "main_data.hdf5"),
    "no metadata": metadata(gone, "no file", "metadata.json"),
    "empty metadata": metadata(empty, "metadata.json"),
    "metadata cut off": metadata(cut, "metadata.json"),
    "metadata that are a list": metadata(being("[]"), "expected dict", "[]"),
    "metadata nested too deeply": metadata(being("[" * 100_000), "nested too deeply"),
    "metadata that name a key twice": metadata(being('{"a": 1, "a": 2}'), "twice", "a"),
    "a version of Minari to come": metadata(keyed(minari_version="9.9.9"), "minari_version", "9.9.9"),
    "another format": metadata(keyed(data_format="zarr"), "zarr", "hdf5", "arrow"),
    "no observation space": metadata(no_space, "observation_space"),
    "a space that is no JSON": metadata(keyed(action_space="Box"), "cannot be read"),
    "a space of no known type": data(space("action", type="Graph"), *AGAIN),
    "a space of no size": data(space("action", **BOX | {"shape": [3]}), *AGAIN),
    "an environment of a module": metadata(keyed(env_spec='{"id": "os:Env-v0"}'), "os:Env-v0", "module"),
    "an environment of no name": metadata(keyed(env_spec="{}"), "env_spec.id", "str"),
    "an environment that is no JSON": metadata(keyed(env_spec="Hopper")),
    "more episodes than in the file": metadata(keyed(total_episodes=60), "60 episodes", "has 6"),
    "no episodes in the metadata": metadata(keyed(total_episodes=0), "0 episodes", "at least 1"),
    "episodes that are no number": metadata(keyed(total_episodes="six"), "total_episodes", "'six'"),
    "a score that is no number": metadata(keyed(ref_max_score=float("nan")), "ref_max_score", "nan"),
    "made in an unknown way": metadata(keyed(irl_recorded={"how": "well"}), "irl_recorded", "missing"),
    "an author who is a number": metadata(keyed(author=[7]), "author[0]", "7"),
    "observations in a dict": data(
        space("observation", type="Dict", subspaces={"x": BOX}), "Dict", "flat Box"
    ),
    "observations in a tuple": data(space("observation", type="Tuple", subspaces=[BOX]), "Tuple", "flat Box"),
    "observations that are images": data(
        space("observation", type="Box", dtype="uint8", shape=[8, 8, 3], low=IMAGE, high=IMAGE),
        *("uint8", "(8, 8, 3)", "flat Box"),
    ),
    "observations that are bytes": data(
        space("observation", **BOX | {"dtype": "uint8", "low": [0, 0]}), "flat"
    ),
    "observations that are discrete": data(
        space("observation", type="Discrete", n=4, start=0), "Discrete(4)"
    ),
    "actions that are discrete": data(
        space("action", type="Discrete", n=4, start=0), "episode 0", "actions of float", "whole numbers"
    ),
    "several choices": data(
        space("action", type="MultiDiscrete", dtype="int64", nvec=[2, 3], start=[0, 0]),
        *("MultiDiscrete", "flat Box"),
    ),
}

VALUES = {
    "an observation that is nan": data(
        number("observations", (3, 1), np.nan),
        "episode 2",
        "nan in observations",
        "column 1",
        "step 3",
        *AGAIN,
    ),
    "an action that is infinite": data(
        number("actions", (4, 0), np.inf), "episode 2", "inf in actions", "column 0", "step 4", *AGAIN
    ),
    "a reward that is nan": data(
        number("rewards", 5, np.nan), "episode 2", "nan in rewards", "step 5", *AGAIN
    ),
    "an episode of no steps": data(hdf5(no_steps), "episode 2 has no steps", *AGAIN),
    "an episode that goes on after its end": data(hdf5(early_end), "episode 2 ends at step 7", "29", *AGAIN),
    "an observation too few": data(
        column("observations", np.zeros((30, 2))), "episode 2", "(30, 2)", "(31, 2)", *AGAIN
    ),
    "observations of three": data(column("observations", np.zeros((31, 3))), "(31, 3)", "(31, 2)", *AGAIN),
    "actions of three": data(column("actions", np.zeros((30, 3))), "(30, 3)", "(30, 2)", *AGAIN),
    "no actions": data(column("actions", None), "actions", *AGAIN),
    "actions that are text": data(
        column("actions", [[b"a", b"b"]] * 30), "actions", "not real numbers", *AGAIN
    ),
    "rewards in two columns": data(column("rewards", np.zeros((30, 2))), "rewards", "(30, 2)", *AGAIN),
    "ends of half an episode": data(
        column("truncations", np.zeros(15, bool)), "truncations", "(15,)", *AGAIN
    ),
    "a missing episode": data(
        hdf5(lambda file: file.__delitem__("episode_2")), "6 episodes", "has 5", *AGAIN
    ),
    "rewards in another file": data(hdf5(elsewhere), "rewards", "link", *AGAIN),
    "rewards in another file's bytes": data(hdf5(outside), "rewards", "another file", *AGAIN),
    "actions behind a dangling link": data(hdf5(dangling), "actions", "link", *AGAIN),
    "a terabyte in a small file": data(hdf5(endless), "GB", *AGAIN),
    "an action beyond its bounds": data(
        number("actions", (4, 0), 1.00001),
        *("episode 2", "step 4", "column 0", "1.00001", "-1 to 1", "clipped"),
        words=TRAIN,
    ),
    "nan in what is trained on": data(
        number("observations", (0, 0), np.nan), "episode 2", "step 0", words=TRAIN
    ),
    "more episodes than there are": Case(f"{TRAIN} --demo-episodes 7", ("7", "6", "expected 1 to 6")),
    "demonstrations of another task": Case(
        f"train gail --env-id Hopper-v5 --demos {DATASET} --out new", ("11", "2")
    ),
}
