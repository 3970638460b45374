"""A task's full name: a Gymnasium id, and with a question mark what the environment is given.

>>> full_name("Hopper-v5", ("ctrl_cost_weight=0.5",))
'Hopper-v5?{"ctrl_cost_weight":0.5}'
>>> split_name('Hopper-v5?{"ctrl_cost_weight":0.5}')
('Hopper-v5', {'ctrl_cost_weight': 0.5})

One string says which task it is wherever a task is named: in settings, cards, policies and rewards, so a
variant is never taken for the task itself.
"""

import json
from collections.abc import Sequence
from typing import Any

from irl.core.errors import UserError

OBS_KEYS = "obs_keys"
"""Argument that names the parts of a dictionary of observations (`irl.envs.flatten`)."""

_PYTHON: dict[str, Any] = {"True": True, "False": False, "None": None}
"""Python's own words for what JSON has: as text, each would be true where it is asked."""

_HINT = "; expected name=value, the value as JSON or text, or one JSON object, e.g. '{\"x\": 1}'"


def split_name(name: str) -> tuple[str, dict[str, Any]]:
    """The Gymnasium id in a full name, and the keyword arguments after it.

    Raises:
        UserError: what follows the question mark is no JSON object.
    """
    env_id, mark, content = name.partition("?")
    return env_id, _object(content, f"what follows the ? in {name!r:.120}") if mark else {}


def other_parts(a: str, b: str) -> bool:
    """Whether two full names put other parts of a dictionary of observations in a row, or these otherwise."""
    first, second = (split_name(name)[1].get(OBS_KEYS) for name in (a, b))
    return first is not None and second is not None and first != second


def full_name(env_id: str, words: Sequence[str]) -> str:
    """The task's full name with the arguments that `words` say, those of `env_id` itself among them.

    Args:
        words: each `name=value`, or a JSON object as text.

    Raises:
        UserError: a word is neither, or names an argument again.
    """
    bare, given = split_name(env_id)
    for word in words:
        more = _object(word, repr(word)[:120]) if word.lstrip().startswith("{") else _pair(word)
        if twice := sorted(given.keys() & more.keys()):
            raise UserError(f"--env-kwargs names {', '.join(twice)} twice; leave one away")
        given |= more
    return f"{bare}?{json.dumps(given, sort_keys=True, separators=(',', ':'))}" if given else bare


def _pair(word: str) -> dict[str, Any]:
    name, sign, value = word.partition("=")
    if not sign or not name.isidentifier():
        raise UserError(f"--env-kwargs {word!r:.80} is no argument{_HINT}")
    try:
        return {name: json.loads(value)}
    except (ValueError, RecursionError):
        return {name: _PYTHON.get(value, value)}


def _object(content: str, what: str) -> dict[str, Any]:
    try:
        found = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise UserError(f"{what} is not readable JSON{_HINT}") from error
    if not isinstance(found, dict):
        raise UserError(f"{what} is no JSON object{_HINT}")
    return found
