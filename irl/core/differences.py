"""What two sets of settings disagree about."""

from collections.abc import Collection, Mapping
from typing import Any


def without(settings: Mapping[str, Any], names: Collection[str]) -> dict[str, Any]:
    """The settings but for some at the top."""
    return {name: value for name, value in settings.items() if name not in names}


def differences(before: Any, now: Any, where: str = "") -> list[str]:
    """One line for each setting that is another one now, with its path.

    >>> differences({"lr": 0.1, "net": {"hidden": [8]}}, {"lr": 0.2, "net": {"hidden": [8]}})
    ['lr was 0.1 and is 0.2']
    """
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        names = [*before, *(name for name in now if name not in before)]
        found = []
        for name in names:
            path = f"{where}.{name}" if where else str(name)
            if name not in now:
                found.append(f"{path} was {before[name]!r} and is gone")
            elif name not in before:
                found.append(f"{path} is new: {now[name]!r}")
            else:
                found += differences(before[name], now[name], path)
        return found
    return [] if before == now else [f"{where} was {before!r} and is {now!r}"]
