"""Numbers and tables as Markdown."""

import math
from collections.abc import Iterable, Sequence

from irl.bench.statistics import Estimate


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join([*lines, *("| " + " | ".join(map(str, row)) + " |" for row in rows)])


def bare(task: str) -> str:
    """A task without its version."""
    return task.rpartition("-v")[0] or task


def short(value: float | None, digits: int = 3) -> str:
    """A number about 1 without its leading nought.

    >>> short(0.951), short(-0.02, 2), short(1.0, 1), short(None)
    ('.951', '-.02', '1.0', '-')
    """
    if value is None or not math.isfinite(value):
        return "-"
    said = f"{value:.{digits}f}"
    return said.replace("0.", ".", 1) if said.lstrip("-").startswith("0.") else said


def estimate(found: Estimate, digits: int = 3) -> str:
    """A number with its interval."""
    interval = (
        f" ({short(found.low, digits)} to {short(found.high, digits)})" if math.isfinite(found.low) else ""
    )
    return short(found.value, digits) + interval


def thousands(steps: float | None) -> str:
    """Steps to the nearest thousand."""
    return "-" if steps is None else f"{steps / 1000:.0f}k"
