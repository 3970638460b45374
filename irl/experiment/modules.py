"""`--import MODULE` in any command: code that the user names, so that a task of their own is registered.

Only what is typed is imported. A run's files name no module, so it is typed again with `irl evaluate` and the
others; what a file may name is in `irl.envs.make.check_module`.
"""

import importlib
import os
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

from irl.core.errors import UserError

FLAG = "--import"


def import_named(words: list[str]) -> list[str]:
    """The words without `--import MODULE` or `--import=MODULE`, those modules imported.

    Raises:
        UserError: no module is named, or it cannot be imported.
    """
    rest, left = [], iter(words)
    for word in left:
        name, sign, value = word.partition("=")
        if name != FLAG:
            rest.append(word)
        elif module := value if sign else next(left, ""):
            import_module(module, FLAG)
        else:
            raise UserError(f"{FLAG} names no module; expected one, e.g. {FLAG} my_tasks")
    return rest


def import_module(name: str, flag: str) -> ModuleType:
    """The module of that name, looked for in the working folder last.

    Raises:
        UserError: there is none, or it raised; names `flag`.
    """
    if (here := os.getcwd()) not in sys.path:
        # an installed program does not look there; last, so that nothing there hides a package
        sys.path.append(here)
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        # ValueError below: an empty or relative name
        raise UserError(f"{flag} {name}: {error}; it is looked for in Python's path and in {here}") from error
    except Exception as error:
        raise UserError(
            f"{flag} {name} raised {type(error).__name__}: {error}; --debug shows where"
        ) from error


def function_named(name: str, flag: str) -> Callable[..., Any]:
    """The function that `module:function` names.

    Raises:
        UserError: there is no such module or function, or the name has no colon.
    """
    module, colon, function = name.partition(":")
    if not (module and colon and function):
        raise UserError(f"{flag} {name!r:.80} names no function; expected module:function")
    found = getattr(import_module(module, flag), function, None)
    if not callable(found):
        raise UserError(f"{flag} {name}: the module {module} has no function {function!r}")
    return found
