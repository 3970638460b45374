"""Modules that were typed after `--import`, for the processes that irl starts, which import them too.

They are handed down by the environment of the process, where no file's word gets in.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

VARIABLE = "IRL_IMPORTED"
"""Names of the modules, with commas."""


def inherited() -> list[str]:
    """What was typed for this process, or for the one that started it."""
    return [name for name in os.environ.get(VARIABLE, "").split(",") if name]


@contextmanager
def handed_down(modules: Sequence[str]) -> Iterator[None]:
    """While this lasts, processes that are started inherit these modules and no others."""
    before = os.environ.pop(VARIABLE, None)
    if modules:
        os.environ[VARIABLE] = ",".join(modules)
    try:
        yield
    finally:
        os.environ.pop(VARIABLE, None)
        if before is not None:
            os.environ[VARIABLE] = before
