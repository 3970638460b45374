"""Frozen dataclasses to JSON and back, with a `kind` wherever there is a choice.

`dataclasses.asdict` forgets which member of a union was chosen; a class that is a choice says so with a
`KIND: ClassVar[str]`, which is written as "kind" and decides on the way back.

A class whose settings have become more says in `ADDED: ClassVar[dict]` what those were, in effect, before
they could be set: what was written then is read as it was meant, whatever a default is by now.
"""

import sys
import types
import typing
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from irl.core.errors import UserError

MOST_SEED = 2**32 - 1
"""numpy's global generator, which SB3 seeds, takes no larger one."""


def check_at_least(config: object, least: int, *names: str) -> None:
    """Refuse settings below `least`.

    Raises:
        ValueError: one is; it is named with its value.
    """
    for name in names:
        if (value := getattr(config, name)) < least:
            raise ValueError(f"{name} must be at least {least}, not {value}")


def check_widths(config: object, *names: str) -> None:
    """Refuse hidden layers without a unit; no hidden layers at all is a linear network.

    Raises:
        ValueError: a width is below 1; the setting is named with its widths.
    """
    for name in names:
        widths = getattr(config, name)
        if any(width < 1 for width in widths):
            shown = " ".join(map(str, widths))
            raise ValueError(
                f"{name} must be widths of at least 1, not {shown}; none at all is a linear network"
            )


MOST_THREADS = 1024


def check_threads(threads: int) -> None:
    """Refuse a number of threads that no machine here has: torch would try to start them.

    Raises:
        ValueError: it is below 1 or above 1024.
    """
    if not 1 <= threads <= MOST_THREADS:
        raise ValueError(f"threads must be in 1 to {MOST_THREADS}, not {threads}")


def check_seed(seed: int) -> None:
    """Refuse a seed that some generator would not take.

    Raises:
        ValueError: it is negative or above 2^32 - 1.
    """
    if not 0 <= seed <= MOST_SEED:
        raise ValueError(f"seed must be in 0 to {MOST_SEED}, not {seed}")


def to_json(config: Any) -> Any:
    """The config as JSON values."""
    if is_dataclass(config):
        content = {field.name: to_json(getattr(config, field.name)) for field in fields(config)}
        kind = getattr(config, "KIND", None)
        return {"kind": kind, **content} if kind else content
    if isinstance(config, tuple | list):
        return [to_json(item) for item in config]
    if isinstance(config, dict):
        return {key: to_json(value) for key, value in config.items()}
    return str(config) if isinstance(config, Path) else config


def from_json(cls: Any, content: Any, where: str = "config") -> Any:
    """The value of type `cls` that `to_json` wrote as `content`.

    Raises:
        UserError: a key is unknown or missing, a kind is unknown, or a value has the wrong type.
    """
    if isinstance(cls, type) and is_dataclass(cls):
        return _dataclass(cls, content, where)
    origin, arguments = get_origin(cls), get_args(cls)
    if origin in (typing.Union, types.UnionType):
        return _union(arguments, content, where)
    if origin is tuple and isinstance(content, list):
        return tuple(from_json(arguments[0], item, f"{where}[{i}]") for i, item in enumerate(content))
    if origin is dict and isinstance(content, dict):
        return {key: from_json(arguments[1], value, f"{where}.{key}") for key, value in content.items()}
    if cls is Path and isinstance(content, str):
        return Path(content)
    if cls is float and _fits_a_float(content):
        return float(content)
    if cls is Any or (cls in (bool, int, str) and type(content) is cls):
        return content
    if origin is typing.Literal and content in arguments:
        return content
    expected = ", ".join(map(repr, arguments)) if origin is typing.Literal else getattr(cls, "__name__", cls)
    raise UserError(f"{where}: expected {expected}, found {_short(content)}")


def _dataclass(cls: type, content: Any, where: str) -> Any:
    if not isinstance(content, dict):
        raise UserError(f"{where}: expected the settings of {cls.__name__}, found {_short(content)}")
    given, kind = {**getattr(cls, "ADDED", {}), **content}, getattr(cls, "KIND", None)
    if kind and given.pop("kind", kind) != kind:
        raise UserError(f"{where}: expected kind {kind!r}, found {_short(content['kind'])}")
    hints = get_type_hints(cls)
    names = [field.name for field in fields(cls)]
    if unknown := sorted(set(given) - set(names)):
        raise UserError(f"{where}: unknown {', '.join(unknown)}; known: {', '.join(names)}")
    if missing := [name for name in names if name not in given]:
        raise UserError(f"{where}: missing {', '.join(missing)}")
    values = {name: from_json(hints[name], given[name], f"{where}.{name}") for name in names}
    try:
        return cls(**values)
    except ValueError as error:
        raise UserError(f"{where}: {error}") from error


def _fits_a_float(content: Any) -> bool:
    # JSON as Python reads it has NaN, infinity and integers that no float holds
    return type(content) in (int, float) and abs(content) <= sys.float_info.max


def _union(members: tuple[Any, ...], content: Any, where: str) -> Any:
    if content is None and type(None) in members:
        return None
    members = tuple(member for member in members if member is not type(None))
    if len(members) == 1:
        return from_json(members[0], content, where)
    kinds = {member.KIND: member for member in members}
    kind = content.get("kind") if isinstance(content, dict) else None
    if not isinstance(kind, str) or kind not in kinds:
        raise UserError(f"{where}: kind is one of {', '.join(kinds)}, found {_short(kind)}")
    return from_json(kinds[kind], content, where)


def _short(content: Any) -> str:
    """The value in at most 60 characters; whatever was given, the message stays a line."""
    try:
        shown = repr(content)
    except ValueError:
        # Python refuses to write integers of thousands of digits
        shown = f"an integer of {content.bit_length()} bits"
    return shown if len(shown) <= 60 else f"{shown[:57]}..."
