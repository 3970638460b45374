"""The episodes in Minari's HDF5 file, as they were recorded; what cannot have happened is refused."""

import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from jaxtyping import Float

from irl.core.types import Episode
from irl.envs.tasks import Task

DATA = "main_data.hdf5"
MOST_TIMES = 100
MOST_BYTES = 2**26
"""What the file unpacks to may be this many times its size; a small file may always hold this much."""


def read(path: Path, n: int, sizes: tuple[int, int], task: Task | None) -> list[Episode]:
    """The `n` episodes of a file, with observations and actions of `sizes`.

    A step's row of `infos` is what the environment said after the step; the row of the reset, which Minari
    keeps first, is left out. Where every term of `task` was recorded, they are the episode's terms.

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
        _check_links(file, path.stat().st_size)
        return [_episode(_group(file, f"episode_{i}"), i, sizes, task) for i in range(n)]


def check_episode(index: int, episode: Episode) -> None:
    """Refuse observations, actions, rewards or reward terms that are not finite.

    Raises:
        ValueError: names episode, step and column.
    """
    columns = {"observations": episode.obs, "actions": episode.action, "rewards": episode.reward}
    terms = {f"the reward term {name}": values for name, values in episode.terms.items()}
    for name, values in {**columns, **terms}.items():
        finite = np.isfinite(values)
        if not finite.all():
            step, *column = (int(i) for i in np.argwhere(~finite)[0])
            where = f"{name}, column {column[0]}," if column else name
            value = values[step, *column]
            raise ValueError(
                f"episode {index} has {value} in {where} at step {step}; expected finite numbers"
            )


def _check_links(file: h5py.File, size: int) -> None:
    """Refuse what leads out of the file, and what would fill the memory."""
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


def _episode(group: h5py.Group, index: int, sizes: tuple[int, int], task: Task | None) -> Episode:
    reward = _numbers(group, "rewards", index, (None,))
    steps = len(reward)
    if steps == 0:
        raise ValueError(f"episode {index} has no steps; expected at least one")
    terminated, truncated = (
        _numbers(group, name, index, (steps,)).astype(bool) for name in ("terminations", "truncations")
    )
    ends = np.flatnonzero(terminated | truncated)
    if len(ends) and ends[0] != steps - 1:
        raise ValueError(f"episode {index} ends at step {ends[0]} and goes on to step {steps - 1}")
    columns = _infos(group, steps)
    known = task is not None and all(key in columns for key in task.terms)
    terms = task.terms if task is not None and known else {}
    episode = Episode(
        obs=_numbers(group, "observations", index, (steps + 1, sizes[0])).astype(np.float64),
        action=_numbers(group, "actions", index, (steps, sizes[1])),
        reward=reward.astype(np.float64),
        terminated=bool(terminated[-1]),
        # an episode that nothing ended was cut off by the recording
        truncated=bool(truncated[-1]) or not terminated[-1],
        terms={name: columns[key] for key, name in terms.items()},
        infos={key: values for key, values in columns.items() if key not in terms},
        seed=_seed(group),
    )
    check_episode(index, episode)
    return episode


def _numbers(group: h5py.Group, name: str, index: int, shape: tuple[int | None, ...]) -> np.ndarray:
    """A column of an episode; None in `shape` is any length."""
    found = group[name]
    if not isinstance(found, h5py.Dataset) or found.dtype.kind not in ("f" if len(shape) > 1 else "fiub"):
        raise ValueError(f"episode {index} has {name} that are not real numbers")
    if len(found.shape) != len(shape) or any(
        wanted not in (None, size) for size, wanted in zip(found.shape, shape, strict=True)
    ):
        wanted = str(shape).replace("None", "any")
        raise ValueError(f"episode {index} has {name} of shape {found.shape}; expected {wanted}")
    return np.asarray(found[()])


def _infos(group: h5py.Group, steps: int) -> dict[str, Float[np.ndarray, "T"]]:
    """The infos that are one number a step; other recorders leave out the row of the reset."""
    infos = group.get("infos")
    columns = {}
    for key, item in infos.items() if isinstance(infos, h5py.Group) else ():
        one_each = isinstance(item, h5py.Dataset) and item.shape in ((steps,), (steps + 1,))
        if one_each and item.dtype.kind in "biuf":
            columns[key] = np.asarray(item[()])[-steps:].astype(np.float64)
    return columns


def _seed(group: h5py.Group) -> int | None:
    seed = group.attrs.get("seed")
    return int(seed) if isinstance(seed, np.integer) else None


def _group(file: h5py.File, name: str) -> h5py.Group:
    found = file[name]
    if not isinstance(found, h5py.Group):
        raise ValueError(f"{name} is not a group of the file")
    return found
