"""Whether a verdict of evaluation.json is good news."""

from collections.abc import Mapping
from typing import Any

from irl.diagnostics.verdicts import WELCOME


def state(row: Mapping[str, Any]) -> str:
    """`good`, `warning` or `unknown`."""
    fired = row.get("fired")
    if not isinstance(fired, bool):
        return "unknown"
    return "good" if fired == (row.get("name") in WELCOME) else "warning"
