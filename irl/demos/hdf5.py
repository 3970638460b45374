"""The episodes in Minari's HDF5 file, read without running anything that the file names."""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos.episodes import Columns, Layout, to_episode

DATA = "main_data.hdf5"
MOST_TIMES = 100
MOST_BYTES = 2**26
"""What the file unpacks to may be this many times its size; a small file may always hold this much."""


def read(path: Path, n: int, layout: Layout) -> list[Episode]:
    """The `n` episodes of a file.

    Raises:
        ValueError: names the episode, and the step and the column where there is one.
        LookupError, TypeError, OSError, RuntimeError: what h5py makes of a damaged file.
    """
    if not path.is_file():
        raise ValueError(f"no file {path}")
    if n < 1:
        raise ValueError(f"it has {n} episodes; expected at least 1")
    with h5py.File(path, "r") as file:
        if len(file) != n:
            raise ValueError(f"the metadata say {n} episodes, the file has {len(file)}")
        check_links(file, path.stat().st_size)
        return [to_episode(_columns(file, i, layout), i, layout) for i in range(n)]


def stored_key(key: object) -> str:
    """What an `info` key is called in a file, where a `/` would make a group: %2F; `key_of` undoes it.

    >>> stored_key("reward/ctrl")
    'reward%2Fctrl'

    Raises:
        UserError: HDF5 has no such name.
    """
    if not isinstance(key, str) or key in ("", ".") or "\0" in key:
        raise UserError(
            f"the info has the key {key!r:.40}, which HDF5 has no name for; expected text: have the "
            f"environment call it e.g. 'speed'"
        )
    return re.sub("%(?=2F|25)", "%25", key).replace("/", "%2F")


def key_of(name: str) -> str:
    """The `info` key that is called so in a file, or lies there in groups.

    >>> key_of("reward%2Fctrl"), key_of("reward/ctrl")
    ('reward/ctrl', 'reward/ctrl')
    """
    return re.sub("%(2F|25)", lambda found: "/" if found[1] == "2F" else "%", name)


def check_links(file: h5py.File, size: int) -> None:
    """Refuse what leads out of the file, and what would fill the memory.

    Raises:
        ValueError: names it.
    """
    links: list[tuple[str, Any]] = []
    # only noted here: h5py does not always survive an exception out of a visitor
    file.visititems_links(lambda name, link: links.append((name, link)))
    total = 0
    for name, link in links:
        if not isinstance(link, h5py.HardLink):
            raise ValueError(f"{name!r:.80} is a link; expected the data themselves")
        item = file[name]
        if isinstance(item, h5py.Dataset):
            if item.is_virtual or item.external:
                raise ValueError(f"{name!r:.80} is kept in another file; expected the data themselves")
            # not nbytes, which is computed in 64 bits and may overflow
            total += math.prod(item.shape or ()) * item.dtype.itemsize
    if total > max(MOST_BYTES, MOST_TIMES * size):
        raise ValueError(f"it claims to hold {total / 1e9:.1f} GB in a file of {size / 1e6:.1f} MB")


def _columns(file: h5py.File, index: int, layout: Layout) -> Columns:
    group = file[f"episode_{index}"]
    if not isinstance(group, h5py.Group):
        raise ValueError(f"episode_{index} is not a group of the file")
    infos, seed = group.get("infos"), group.attrs.get("seed")
    of_keys = {key: _array(group, f"observations/{key}", index) for key in layout.obs_keys}
    return Columns(
        of_keys or _array(group, "observations", index),
        *(_array(group, name, index) for name in ("actions", "rewards", "terminations", "truncations")),
        infos=dict(_infos(infos)) if isinstance(infos, h5py.Group) else {},
        seed=int(seed) if isinstance(seed, np.integer) else None,
    )


def _infos(group: h5py.Group) -> Iterator[tuple[str, np.ndarray]]:
    """Every column below the group: other recorders nest them, or make groups of a key with a `/`."""
    names: list[str] = []
    # it goes into a group once, also where that is linked into itself
    group.visititems_links(lambda name, _: names.append(name))
    for name in names:
        if isinstance(item := group[name], h5py.Dataset):
            yield key_of(name), np.asarray(item[()])


def _array(group: h5py.Group, name: str, index: int) -> np.ndarray:
    found = group[name]
    if not isinstance(found, h5py.Dataset):
        raise ValueError(f"episode {index} has {name} that are not real numbers")
    return np.asarray(found[()])
