"""The words of a command as its settings; what is wrong with them in one line."""

import contextlib
import io
import math
from dataclasses import fields, is_dataclass
from typing import Any

import tyro

from irl.core.errors import UserError
from irl.experiment.imitation_run import AdversarialRun
from irl.experiment.preset import with_preset


def parsed(cls: type, words: list[str], program: str) -> Any:
    """The command that the words say.

    Raises:
        UserError: tyro's boxed complaint as one line, or a number is not finite.
        SystemExit: help was asked for, and printed.
    """
    default = _default(cls, words)
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            found = tyro.cli(cls, args=words, prog=program, **({"default": default} if default else {}))
    except SystemExit as stop:
        if stop.code in (0, None):
            raise
        frame = str.maketrans(dict.fromkeys("╭╮╰╯│─┌┐└┘", " "))
        raise UserError(complaint.getvalue().translate(frame)) from None
    _check_finite(found, "")
    return found


def _check_finite(value: Any, name: str) -> None:
    """Refuse nan and infinity wherever they are: comparisons let them by, and no JSON has them.

    Raises:
        UserError: names the setting as it is typed.
    """
    if is_dataclass(value):
        for field in fields(value):
            _check_finite(getattr(value, field.name), f"{name}.{field.name}".lstrip("."))
    elif isinstance(value, tuple | list):
        for item in value:
            _check_finite(item, name)
    elif isinstance(value, float) and not math.isfinite(value):
        raise UserError(f"--{name.replace('_', '-')} is {value}; expected a finite number")


def _default(cls: type, words: list[str]) -> Any:
    """The settings that typed ones go over where a preset is named; None where none is."""
    if not issubclass(cls, AdversarialRun) or (name := _typed(words, "--preset")) is None:
        return None
    # without a task the words are refused in any case
    env_id = _typed([word.replace("--env_id", "--env-id") for word in words], "--env-id")
    return with_preset(cls(env_id=env_id), name) if env_id else None


def _typed(words: list[str], flag: str) -> str | None:
    """What follows a flag, the last time that it is typed."""
    found = None
    for word, following in zip(words, [*words[1:], ""], strict=True):
        name, given, value = word.partition("=")
        if name == flag:
            found = value if given else following
    return found
