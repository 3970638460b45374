"""`--import MODULE` in any command: code that the user names, so that a task of their own is registered.

Only what is typed is imported. A run's files name no module, so it is typed again with `irl evaluate` and the
others; what a file may name is in `irl.envs.make.check_module`. Processes that a command starts import
them too.
"""

import importlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from irl.core.errors import UserError
from irl.envs.inherited import handed_down, inherited

FLAG = "--import"


@contextmanager
def imported(words: list[str]) -> Iterator[list[str]]:
    """The words without `--import MODULE` or `--import=MODULE`, those modules imported.

    Those that were typed for the process that started this one are imported too, and while this lasts, a
    process that is started inherits all of them.

    Raises:
        UserError: no module is named, or it cannot be imported.
    """
    rest, typed = _typed(words)
    modules = list(dict.fromkeys([*inherited(), *typed]))
    for module in modules:
        import_module(module, FLAG)
    with handed_down(modules):
        yield rest


def _typed(words: list[str]) -> tuple[list[str], list[str]]:
    """The other words, and the modules."""
    rest, modules, left = [], [], iter(words)
    for word in left:
        name, sign, value = word.partition("=")
        if name != FLAG:
            rest.append(word)
        elif module := value if sign else next(left, ""):
            modules.append(module)
        else:
            raise UserError(f"{FLAG} names no module; expected one, e.g. {FLAG} my_tasks")
    return rest, modules


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
