"""Nested state (dicts, lists, numbers, tensors, arrays) as one JSON and one safetensors file.

    save(folder, state);  load(folder) == state

No pickle: a checkpoint that somebody else made can be read without running anything of theirs. Both
files are checked against their SHA-256, so a flipped byte is damage and not another weight. A `Log` is
appended to the run's own pieces, and comes back as `Rows`.
"""

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.numpy import load as unpacked
from safetensors.numpy import save as packed

from irl.core import files
from irl.core.errors import UserError
from irl.core.log import Log, Logs, Segment

STRUCTURE, ARRAYS = "state.json", "state.safetensors"


def save(folder: Path, state: Any, logs: Logs | None = None) -> None:
    """Write `state` into `folder`, and what its logs have gained into `logs`.

    Raises:
        TypeError: something in it is neither a plain Python value, nor a tensor or numeric array.
    """
    arrays: dict[str, np.ndarray] = {}
    structure = _encode(state, arrays, logs)
    content = packed(arrays)
    folder.mkdir(parents=True, exist_ok=True)
    files.write_bytes(folder / ARRAYS, content)
    arrays_digest = hashlib.sha256(content).hexdigest()
    document = {"sha256": _digest(structure, arrays_digest), "arrays": arrays_digest, "state": structure}
    files.write_bytes(folder / STRUCTURE, json.dumps(document).encode())


def load(folder: Path, logs: Logs | None = None) -> Any:
    """What `save` wrote: tensors on the CPU, tuples and integer keys as they were.

    Raises:
        UserError: a file is missing or damaged.
    """
    document = files.read_json(folder / STRUCTURE)
    try:
        structure, arrays_digest = document["state"], document["arrays"]
        if _digest(structure, arrays_digest) != document["sha256"]:
            raise ValueError(f"{STRUCTURE} is not what was written")
        content = (folder / ARRAYS).read_bytes()
        if hashlib.sha256(content).hexdigest() != arrays_digest:
            raise ValueError(f"{ARRAYS} is not what was written")
        return _decode(structure, unpacked(content), logs)
    except (SafetensorError, OSError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise UserError(f"{folder} is damaged ({error})") from error


def used_segments(folder: Path) -> list[tuple[str, Segment]]:
    """The pieces of logs that a saved state refers to; none where it cannot be read."""
    found: list[tuple[str, Segment]] = []

    def walk(value: Any) -> None:
        if isinstance(value, dict) and value.get("") == "log":
            name, _, _, segments = value["of"]
            found.extend((name, (first, last, digest)) for first, last, digest in segments)
        elif isinstance(value, dict):
            walk(value.get("of"))
        elif isinstance(value, list):
            for item in value:
                walk(item)

    try:
        walk(files.read_json(folder / STRUCTURE)["state"])
    except (UserError, OSError, KeyError, TypeError, ValueError):
        return []
    return found


def _digest(structure: Any, arrays_digest: str) -> str:
    return hashlib.sha256((json.dumps(structure) + arrays_digest).encode()).hexdigest()


def _encode(value: Any, arrays: dict[str, np.ndarray], logs: Logs | None) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, torch.Tensor | np.ndarray):
        kind = "tensor" if isinstance(value, torch.Tensor) else "array"
        content = value.detach().cpu().numpy() if isinstance(value, torch.Tensor) else value
        if content.dtype.kind not in "biuf":
            raise TypeError(f"cannot save an array of {content.dtype}: {value!r:.80}")
        name = str(len(arrays))
        arrays[name] = np.ascontiguousarray(content).reshape(content.shape)
        return {"": kind, "of": name}
    if isinstance(value, list):
        return [_encode(item, arrays, logs) for item in value]
    if isinstance(value, tuple):
        return {"": "tuple", "of": [_encode(item, arrays, logs) for item in value]}
    if isinstance(value, dict):
        # items, not an object: optimiser states have integer keys
        pairs = [[_encode(k, arrays, logs), _encode(v, arrays, logs)] for k, v in value.items()]
        return {"": "dict", "of": pairs}
    if isinstance(value, Log) and logs is not None:
        return {"": "log", "of": [value.name, value.start, value.stop, logs.append(value)]}
    raise TypeError(f"cannot save a {type(value).__name__}: {value!r:.80}")


def _decode(value: Any, arrays: dict[str, np.ndarray], logs: Logs | None) -> Any:
    if isinstance(value, list):
        return [_decode(item, arrays, logs) for item in value]
    if not isinstance(value, dict):
        return value
    match value[""], value["of"]:
        case "tensor", name:
            return torch.from_numpy(arrays[name].copy())
        case "array", name:
            return arrays[name]
        case "tuple", items:
            return tuple(_decode(item, arrays, logs) for item in items)
        case "dict", pairs:
            return {_decode(k, arrays, logs): _decode(v, arrays, logs) for k, v in pairs}
        case "log", (name, start, stop, segments):
            if logs is None:
                raise ValueError(f"the pieces of its log {name!r} are not at hand")
            return logs.load(name, start, stop, [(a, b, digest) for a, b, digest in segments])
        case kind, _:
            raise ValueError(f"unknown kind {kind!r}")
