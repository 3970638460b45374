"""Files of demonstrations from elsewhere as arrays by meaning: .npz, .csv, .hdf5 and .parquet.

    meaning      names it goes by
    obs          observations, obs, states, observation.state       needed
    actions      actions, acts, action
    rewards      rewards, rews, reward, next.reward
    terminated   terminals, terminations, terminated                the task ended the episode after this step
    truncated    timeouts, truncations, truncated                   a time limit did
    next_obs     next_observations, next_obs, next_states
    episode      episode_ids, episodes, episode, episode_index      a number for each step
    step         steps, timesteps, step, frame_index                counts up by one within an episode
    starts       episode_starts                                     the step is the first of its episode
    infos/NAME   infos/NAME, infos.NAME                             other numbers of each step

In .csv an observation is the columns obs_0, obs_1, ...; the others in the same way. No pickle is read: an
array of Python objects is refused.
"""

import csv
import re
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from irl.core.errors import UserError
from irl.demos import arrow
from irl.demos.hdf5 import MOST_BYTES, MOST_TIMES, check_links

NAMES = {
    "obs": ("observations", "obs", "states", "observation.state"),
    "actions": ("actions", "acts", "action"),
    "rewards": ("rewards", "rews", "reward", "next.reward"),
    "terminated": ("terminals", "terminations", "terminated"),
    "truncated": ("timeouts", "truncations", "truncated"),
    "next_obs": ("next_observations", "next_obs", "next_states"),
    "episode": ("episode_ids", "episodes", "episode", "episode_index"),
    "step": ("steps", "timesteps", "step", "frame_index"),
    "starts": ("episode_starts",),
}
_MEANING = {name: meaning for meaning, names in NAMES.items() for name in names}
_INFO = re.compile(r"infos[/.](.+)")
_NUMBERED = re.compile(r"(.*?)[_.\[]?(\d+)\]?")
_WORDS = {"true": 1.0, "false": 0.0}


@dataclass(frozen=True)
class Source:
    """The arrays of a file, by meaning."""

    arrays: Mapping[str, np.ndarray]
    infos: Mapping[str, np.ndarray] = field(default_factory=dict)
    unused: tuple[str, ...] = ()
    """Names that mean nothing here."""


def read_source(path: Path) -> Source:
    """The arrays of a file; its ending says which format it has.

    Raises:
        UserError: no such file, an unknown ending, damaged, or no observations in it.
    """
    readers = {
        ".npz": _npz,
        ".csv": _csv,
        ".hdf5": _hdf5,
        ".h5": _hdf5,
        ".parquet": _parquet,
    }
    if (reader := readers.get(path.suffix.lower())) is None:
        raise UserError(f"{path} ends in {path.suffix!r:.20}; expected one of {', '.join(readers)}")
    if not path.is_file():
        raise UserError(f"no file {path}")
    try:
        found = {name: np.asarray(values) for name, values in reader(path).items()}
        return _named(path, found)
    # what numpy, h5py, zip and csv make of damage
    except (ValueError, LookupError, TypeError, OSError, RuntimeError, EOFError, MemoryError) as error:
        if isinstance(error, UserError):
            raise
        raise _damaged(path, error) from error
    except (zipfile.BadZipFile, csv.Error, NotImplementedError) as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: BaseException) -> UserError:
    said = " ".join(str(error).split()) or type(error).__name__
    return UserError(f"{path} cannot be read: {said:.300}")


def _named(path: Path, found: Mapping[str, np.ndarray]) -> Source:
    arrays: dict[str, np.ndarray] = {}
    infos, unused = {}, []
    for name, values in found.items():
        meaning = _MEANING.get(name)
        if info := _INFO.fullmatch(name):
            # one number for the whole file is about no step
            if values.ndim:
                infos[info[1]] = values
            else:
                unused.append(name)
        elif meaning is None:
            unused.append(name)
        elif meaning in arrays:
            raise UserError(f"{path} has several arrays of {meaning}, {name} is one; leave one away")
        elif values.dtype.kind not in "fiub":
            raise UserError(f"{path} has {name} of {values.dtype}; expected numbers")
        elif not values.ndim:
            raise UserError(
                f"{path} has {name} as the single value {values}; expected an array with one for each step: "
                f"leave it away, or repeat it"
            )
        else:
            arrays[meaning] = values
    if "obs" not in arrays:
        there = ", ".join(map(repr, found))[:200] or "nothing"
        raise UserError(f"{path} has no array {NAMES['obs'][0]!r}; it has {there}")
    return Source(arrays, infos, tuple(unused))


def _npz(path: Path) -> dict[str, np.ndarray]:
    with zipfile.ZipFile(path) as archive:
        total = sum(entry.file_size for entry in archive.infolist())
    if total > max(MOST_BYTES, MOST_TIMES * path.stat().st_size):
        raise ValueError(f"it claims to hold {total / 1e9:.1f} GB")
    with np.load(path, allow_pickle=False) as arrays:
        found = {}
        for name in arrays.files:
            try:
                found[name] = arrays[name]
            except ValueError as error:
                if "allow_pickle" not in str(error):
                    raise
                if name in _MEANING:
                    raise ValueError(
                        f"{name} is an array of Python objects, a pickle; save numbers"
                    ) from error
                # e.g. infos as dictionaries: of no use here, and not read
                found[name] = np.array([])
        return found


def _hdf5(path: Path) -> dict[str, np.ndarray]:
    found = {}
    with h5py.File(path, "r") as file:
        check_links(file, path.stat().st_size)
        for name, item in file.items():
            if isinstance(item, h5py.Dataset):
                found[name] = item[()]
            elif name == "infos" and isinstance(item, h5py.Group):
                found |= {f"infos/{k}": v[()] for k, v in item.items() if isinstance(v, h5py.Dataset)}
            else:
                found[name] = np.array([])
    return found


def _parquet(path: Path) -> dict[str, np.ndarray]:
    table = arrow.pyarrow().dataset.dataset(str(path), format="parquet").to_table()
    found = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        try:
            found[name] = arrow.numbers(arrow.pyarrow(), column)
        except ValueError as error:
            if name in _MEANING:
                raise ValueError(f"{name} {error}") from error
            found[name] = np.array([])
    return found


def _csv(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.reader(file)
        header = [name.strip() for name in next(rows, [])]
        if len(set(header)) < len(header):
            raise ValueError("its first line names a column twice")
        numbers = [_line(header, row, i) for i, row in enumerate(rows, start=2) if row]
    table = np.array(numbers, dtype=np.float64).reshape(len(numbers), len(header))
    return _grouped(header, table)


def _line(header: list[str], row: list[str], line: int) -> list[float]:
    if len(row) != len(header):
        raise ValueError(f"line {line} has {len(row)} columns, the first line names {len(header)}")
    numbers = []
    for name, cell in zip(header, row, strict=True):
        word = cell.strip().lower()
        try:
            numbers.append(_WORDS[word] if word in _WORDS else float(word))
        except ValueError:
            raise ValueError(
                f"line {line} has {cell!r:.40} in column {name!r:.40}; expected a number"
            ) from None
    return numbers


def _grouped(header: Iterable[str], table: np.ndarray) -> dict[str, np.ndarray]:
    """Columns as they are, and numbered ones of one name together."""
    found: dict[str, np.ndarray] = {}
    numbered: dict[str, dict[int, np.ndarray]] = {}
    for place, name in enumerate(header):
        split = _NUMBERED.fullmatch(name)
        if split and split[1] in _MEANING:
            numbered.setdefault(split[1], {})[int(split[2])] = table[:, place]
        else:
            found[name] = table[:, place]
    for name, columns in numbered.items():
        if missing := set(range(len(columns))) - columns.keys():
            raise ValueError(f"it has {len(columns)} columns {name}_* and none is {name}_{min(missing)}")
        found[name] = np.stack([columns[i] for i in range(len(columns))], axis=1)
    return found
