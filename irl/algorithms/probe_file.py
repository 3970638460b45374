"""A probe in a file: numpy's `.npz`, without pickle, and readable without irl.

    about.json              task, strata, what plays in each, hashes           (bytes of UTF-8)
    <i>/length, terminated, truncated, seed                                    one a episode; seed -1: none
    <i>/obs                 episodes after one another, one row more than steps each
    <i>/action, <i>/reward, <i>/terms/<name>, <i>/infos/<name>                 one a step

`i` counts the strata in the order of about.json. qpos and qvel of the state that a step starts from are
infos.
"""

import io
import json
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from irl.algorithms.probe_set import ProbeSet, sha256
from irl.core import files
from irl.core.errors import UserError
from irl.core.types import Episode

FORMAT, VERSION = "irl.probe", 1
MOST_BYTES = 8 * 2**30
"""What a probe may take in memory: a small archive can unpack to anything."""


def save_probe(probe: ProbeSet, path: Path) -> None:
    """Write a probe that `load_probe` gives back."""
    columns: dict[str, np.ndarray] = {}
    for i, episodes in enumerate(probe.strata.values()):
        columns |= {f"{i}/{name}": values for name, values in _columns(episodes).items()}
    about = {
        "format": FORMAT,
        "version": VERSION,
        "env_id": probe.env_id,
        "base_sha256": probe.base_sha256,
        "strata": [
            {"name": name, "about": probe.about.get(name, ""), "sha256": sha256(episodes)}
            for name, episodes in probe.strata.items()
        ],
    }
    columns["about.json"] = np.frombuffer(json.dumps(about).encode(), dtype=np.uint8)
    content = io.BytesIO()
    np.savez_compressed(content, **columns)  # pyright: ignore[reportArgumentType]
    files.write_bytes(path, content.getvalue())


def load_probe(path: Path | str) -> ProbeSet:
    """The probe in a file, once its hashes are those of its numbers.

    Raises:
        UserError: there is no file, it is not a probe, or a number in it was changed.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(f"no file {path}; make a probe with: irl probe --env-id Hopper-v5 --out {path}")
    try:
        return _read(path)
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise UserError(f"{path} is not a probe this version reads: {json.dumps(str(error))}") from error


def _read(path: Path) -> ProbeSet:
    with zipfile.ZipFile(path) as archive:
        if (size := sum(member.file_size for member in archive.infolist())) > MOST_BYTES:
            raise ValueError(f"it unpacks to {size} bytes, more than {MOST_BYTES}")
    with np.load(path, allow_pickle=False) as archive:
        about = json.loads(archive["about.json"].tobytes().decode())
        if (about["format"], about["version"]) != (FORMAT, VERSION):
            raise ValueError(f"expected {FORMAT} {VERSION}, found {about['format']} {about['version']}")
        strata, words = {}, {}
        for i, said in enumerate(about["strata"]):
            start = f"{i}/"
            columns = {name[len(start) :]: archive[name] for name in archive.files if name.startswith(start)}
            episodes = _episodes(columns)
            if sha256(episodes) != said["sha256"]:
                raise ValueError(f"the numbers of {said['name']!r:.40} are not those that were written")
            strata[said["name"]], words[said["name"]] = episodes, said["about"]
    return ProbeSet(about["env_id"], strata, words)


def _columns(episodes: tuple[Episode, ...]) -> dict[str, np.ndarray]:
    first = episodes[0]
    columns: dict[str, Any] = {
        "length": [len(e) for e in episodes],
        "terminated": [e.terminated for e in episodes],
        "truncated": [e.truncated for e in episodes],
        "seed": [-1 if e.seed is None else e.seed for e in episodes],
        "obs": np.concatenate([e.obs for e in episodes]),
        "action": np.concatenate([e.action for e in episodes]),
        "reward": np.concatenate([e.reward for e in episodes]),
    }
    for name in first.terms:
        columns[f"terms/{name}"] = np.concatenate([e.terms[name] for e in episodes])
    for name in first.infos:
        columns[f"infos/{name}"] = np.concatenate([e.infos[name] for e in episodes])
    return {name: np.asarray(values) for name, values in columns.items()}


def _episodes(columns: dict[str, np.ndarray]) -> tuple[Episode, ...]:
    length = columns["length"]
    ends = np.cumsum(length)
    if len(columns["obs"]) != int(np.sum(length + 1)):
        raise ValueError(f"expected {int(np.sum(length + 1))} observations, found {len(columns['obs'])}")
    found = []
    for i, (end, steps) in enumerate(zip(ends.tolist(), length.tolist(), strict=True)):
        rows = slice(end - steps, end)
        named = {
            part: {
                name.removeprefix(f"{part}/"): values[rows]
                for name, values in columns.items()
                if name.startswith(f"{part}/")
            }
            for part in ("terms", "infos")
        }
        found.append(
            Episode(
                obs=columns["obs"][end - steps + i : end + i + 1],
                action=columns["action"][rows],
                reward=columns["reward"][rows],
                terminated=bool(columns["terminated"][i]),
                truncated=bool(columns["truncated"][i]),
                seed=None if columns["seed"][i] < 0 else int(columns["seed"][i]),
                **named,
            )
        )
    return tuple(found)
