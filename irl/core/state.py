"""Nested state (dicts, lists, numbers, tensors, arrays) as one JSON and one safetensors file.

    save(folder, state);  load(folder) == state

No pickle: a checkpoint that somebody else made can be read without running anything of theirs.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.numpy import load_file
from safetensors.numpy import save as packed

from irl.core import files
from irl.core.errors import UserError

STRUCTURE, ARRAYS = "state.json", "state.safetensors"


def save(folder: Path, state: Any) -> None:
    """Write `state` into `folder`.

    Raises:
        TypeError: something in it is neither a plain Python value, nor a tensor or numeric array.
    """
    arrays: dict[str, np.ndarray] = {}
    structure = _encode(state, arrays)
    folder.mkdir(parents=True, exist_ok=True)
    files.write_bytes(folder / ARRAYS, packed(arrays))
    files.write_bytes(folder / STRUCTURE, json.dumps(structure).encode())


def load(folder: Path) -> Any:
    """What `save` wrote: tensors on the CPU, tuples and integer keys as they were.

    Raises:
        UserError: a file is missing or damaged.
    """
    structure = files.read_json(folder / STRUCTURE)
    try:
        arrays = load_file(folder / ARRAYS)
        return _decode(structure, arrays)
    except (SafetensorError, OSError, KeyError, TypeError, ValueError) as error:
        raise UserError(f"{folder} is damaged ({error})") from error


def _encode(value: Any, arrays: dict[str, np.ndarray]) -> Any:
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
        return [_encode(item, arrays) for item in value]
    if isinstance(value, tuple):
        return {"": "tuple", "of": [_encode(item, arrays) for item in value]}
    if isinstance(value, dict):
        # items, not an object: optimiser states have integer keys
        return {"": "dict", "of": [[_encode(k, arrays), _encode(v, arrays)] for k, v in value.items()]}
    raise TypeError(f"cannot save a {type(value).__name__}: {value!r:.80}")


def _decode(value: Any, arrays: dict[str, np.ndarray]) -> Any:
    if isinstance(value, list):
        return [_decode(item, arrays) for item in value]
    if not isinstance(value, dict):
        return value
    match value[""], value["of"]:
        case "tensor", name:
            return torch.from_numpy(arrays[name].copy())
        case "array", name:
            return arrays[name]
        case "tuple", items:
            return tuple(_decode(item, arrays) for item in items)
        case "dict", pairs:
            return {_decode(k, arrays): _decode(v, arrays) for k, v in pairs}
        case kind, _:
            raise ValueError(f"unknown kind {kind!r}")
