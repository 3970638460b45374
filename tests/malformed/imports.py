"""Files to import that cannot be, and datasets that cannot be merged or split."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from tests.experiment.conftest import DATASET, TASK
from tests.malformed.damage import cut, empty
from tests.malformed.table import Case

INTO = f"--env-id {TASK} --dataset-id irl/pointmass/new-v0"


def good() -> dict[str, np.ndarray]:
    """Two episodes of ten steps that stand still."""
    ends = np.tile(np.arange(10) == 9, 2)
    return {"observations": np.zeros((20, 2)), "actions": np.zeros((20, 2)), "timeouts": ends}


def npz(*named: str, damage: Callable[[Path], None] = lambda path: None, **changes: np.ndarray) -> Case:
    def write(world: Path) -> None:
        np.savez(world / "demos.npz", **(good() | changes))  # pyright: ignore[reportArgumentType]
        damage(world / "demos.npz")

    return Case(f"demos import demos.npz {INTO}", ("demos.npz", *named), write)


def saved(world: Path) -> None:
    """A file with nothing wrong."""
    np.savez(world / "demos.npz", **good())  # pyright: ignore[reportArgumentType]


def hdf5(change: Callable[[h5py.File], None], *named: str) -> Case:
    def write(world: Path) -> None:
        with h5py.File(world / "demos.hdf5", "w") as file:
            for name, values in good().items():
                file[name] = values
            change(file)

    return Case(f"demos import demos.hdf5 {INTO}", ("demos.hdf5", *named), write)


def csv(text: str, *named: str) -> Case:
    return Case(
        f"demos import demos.csv {INTO}",
        ("demos.csv", *named),
        lambda world: void((world / "demos.csv").write_text(text)),
    )


def void(value: object) -> None:
    """Nothing, of whatever was returned."""


def bomb(path: Path) -> None:
    """A gigabyte of zeros in a small file."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": (2**27, 1)}
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("obs.npy", "w") as file:
        file.write(header.getvalue())
        for _ in range(2**7):
            file.write(bytes(2**20))


def outside(file: h5py.File) -> None:
    del file["actions"]
    file["actions"] = h5py.ExternalLink("/etc/other.hdf5", "/actions")


def at(array: np.ndarray, place: tuple[int, ...], value: float) -> np.ndarray:
    """The array with one other number."""
    array[place] = value
    return array


FILES = {
    "nothing to import": Case(f"demos import demos.npz {INTO}", ("no file demos.npz",)),
    "a file of an unknown kind": Case(f"demos import notes.txt {INTO}", (".txt", ".npz", ".csv", ".hdf5")),
    "arrays cut off": npz("cannot be read", damage=cut),
    "an empty file of arrays": npz("cannot be read", damage=empty),
    "arrays of objects": npz("actions is an array of Python objects", "pickle", actions=np.array([{}] * 20)),
    "arrays that fill the memory": npz("claims to hold", "GB", damage=bomb),
    "arrays of another task": npz("3 numbers", f"{TASK} has 2", observations=np.zeros((20, 3))),
    "arrays with nan": npz(
        "episode 1",
        "nan in observations",
        "column 1",
        "step 4",
        observations=at(np.zeros((20, 2)), (14, 1), np.nan),
    ),
    "arrays with an action beyond": npz(
        "episode 1", "step 4", "column 0", "2", "-1 to 1", actions=at(np.zeros((20, 2)), (14, 0), 2.0)
    ),
    "arrays of different lengths": npz(
        "20 rows of", "19 steps", actions=np.zeros((19, 2)), rewards=np.zeros(20)
    ),
    "arrays without an end": npz("one row", "next_observations", timeouts=np.ones(20, bool)),
    "an episode longer than the task": npz(
        "episode 0",
        "ends after 30",
        observations=np.zeros((40, 2)),
        actions=np.zeros((40, 2)),
        timeouts=np.zeros(40, bool),
    ),
    "a task that is not there": Case(
        "demos import demos.npz --env-id PointMas-v0",
        ("PointMas-v0", TASK),
        saved,
    ),
    "what is no argument": Case(
        f"demos import demos.npz {INTO} --env-kwargs cliff",
        ("'cliff'", "name=value"),
        saved,
    ),
    "a link to another file": hdf5(outside, "actions", "link"),
    "groups where arrays are expected": hdf5(
        lambda f: f.move("observations", "data/observations"), "no array 'observations'", "'data'"
    ),
    "a table of words": csv("obs_0,obs_1,episode\n1,two,0\n", "line 2", "'two'", "obs_1"),
    "a table that is torn": csv("obs_0,obs_1,episode\n1,2,0\n1\n", "line 3 has 1 columns"),
    "a table that is empty": csv("", "no array 'observations'"),
    "a table that is no text": csv("\x00\x01", "no array 'observations'"),
    "a module that is not there": Case("demos list --import no_such_module", ("no_such_module", "--import")),
    "a module that is not named": Case("demos list --import", ("--import names no module",)),
}

CURATED = {
    "one dataset to merge": Case(f"demos merge {DATASET} --into irl/m-v0", ("1 datasets", "two or more")),
    "a dataset merged with itself": Case(f"demos merge {DATASET} {DATASET} --into irl/m-v0", ("each once",)),
    "datasets of two tasks": Case(
        f"demos merge {DATASET} irl/noreward/expert-v0 --into irl/m-v0", (TASK, "NoReward-v0", "one task")
    ),
    "a merge over a dataset": Case(
        f"demos merge {DATASET} irl/noreward/expert-v0 --into {DATASET}", ("already", "--overwrite")
    ),
    "all held out": Case(f"demos split {DATASET} --held-out 1", ("held_out", "between 0 and 1")),
    "a split over a dataset": Case(
        f"demos split {DATASET} --into {DATASET} irl/b-v0", ("already", "--overwrite")
    ),
    "two parts of one name": Case(f"demos split {DATASET} --into irl/b-v0 irl/b-v0", ("two names",)),
    "a split of nothing": Case("demos split irl/nothing-v0", ("no dataset", "irl/nothing-v0")),
}
