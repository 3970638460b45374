"""Ways to damage a file: each takes the path that it damages."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from safetensors import safe_open
from safetensors.numpy import save

from irl.core import files
from irl.demos.metadata import DIGEST

Damage = Callable[[Path], None]


def gone(path: Path) -> None:
    path.unlink()


def empty(path: Path) -> None:
    path.write_bytes(b"")


def cut(path: Path) -> None:
    """The first half of the file."""
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def flipped(path: Path) -> None:
    """Another last byte."""
    content = path.read_bytes()
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))


def being(content: bytes | str) -> Damage:
    """Another content altogether."""
    return lambda path: void(path.write_bytes(content if isinstance(content, bytes) else content.encode()))


def void(_: object) -> None:
    """For what returns something."""


def keyed(*where: str, **changes: Any) -> Damage:
    """Other values in a JSON file, in the object at `where`; `...` takes a key away."""

    def damage(path: Path) -> None:
        content = json.loads(path.read_text())
        inner = content
        for key in where:
            inner = inner[key]
        for key, value in changes.items():
            inner[key] = value
            if value is ...:
                del inner[key]
        path.write_text(json.dumps(content))

    return damage


def foreign(data: Path) -> None:
    """A dataset of another recorder, who leaves no digest."""
    content = json.loads((data / "metadata.json").read_text())
    content.pop(DIGEST, None)
    (data / "metadata.json").write_text(json.dumps(content))


def hdf5(change: Callable[[h5py.File], object]) -> Damage:
    """Other data, in the folder of a dataset that has no digest."""

    def damage(data: Path) -> None:
        foreign(data)
        with h5py.File(data / "main_data.hdf5", "a") as file:
            change(file)

    return damage


def raw(change: Damage) -> Damage:
    """Other bytes of the data, in the folder of a dataset that has no digest."""

    def damage(data: Path) -> None:
        foreign(data)
        change(data / "main_data.hdf5")

    return damage


def column(name: str, value: Any) -> Damage:
    """Another column of episode 2; None takes it away."""

    def change(file: h5py.File) -> None:
        del file[f"episode_2/{name}"]
        if value is not None:
            file[f"episode_2/{name}"] = value

    return hdf5(change)


def number(name: str, where: int | tuple[int, int], value: float) -> Damage:
    """Another number in a column of episode 2."""

    def change(file: h5py.File) -> None:
        found = file[f"episode_2/{name}"]
        assert isinstance(found, h5py.Dataset)
        found[where] = value

    return hdf5(change)


def space(of: str, **content: Any) -> Damage:
    """Another space in the metadata of the dataset in a folder."""
    return lambda data: keyed(**{f"{of}_space": json.dumps(content)})(data / "metadata.json")


def tensors(
    change: Callable[[dict[str, np.ndarray]], object], header: dict[str, Any] | None = None
) -> Damage:
    """Other tensors, or another header, in a safetensors file."""

    def damage(path: Path) -> None:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata()
            weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        change(weights)
        if header is not None:
            assert metadata is not None
            metadata = {"irl": json.dumps(json.loads(metadata["irl"]) | header)}
        path.write_bytes(save(weights, metadata))

    return damage


def weights(change: Callable[[dict[str, np.ndarray]], object]) -> Damage:
    """Other weights of a saved reward in a folder, whose specification agrees to them."""

    def damage(folder: Path) -> None:
        tensors(change)(folder / "weights.safetensors")
        keyed(weights_sha256=files.sha256(folder / "weights.safetensors"))(folder / "spec.json")

    return damage
