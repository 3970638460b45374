"""Which runs are seeds of one thing: those whose settings differ in nothing but the seed and places."""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from irl.report.folder import RunFiles

APART = ("kind", "env_id", "seed", "seeds", "out", "run", "watch", "datasets_root", "device", "threads")
"""Settings that do not make it another thing, or that its label says already."""
SAID = 4
"""Settings that a label says; the rest is counted."""


def labels(runs: Sequence[RunFiles]) -> dict[int, str]:
    """Of each run, by its id, what its seeds are counted with: method, task, and what sets it apart here."""
    settings = [settings_of(run) for run in runs]
    found: dict[int, str] = {}
    for base in dict.fromkeys(map(method_of, runs)):
        mine = [i for i, run in enumerate(runs) if method_of(run) == base]
        paths = dict.fromkeys(path for i in mine for path in settings[i])
        differ = [path for path in paths if len({settings[i].get(path) for i in mine}) > 1]
        taken: dict[str, list[str | None]] = {}
        for i in mine:
            values = [settings[i].get(path) for path in differ]
            said = [f"{path} {value or 'not set'}" for path, value in zip(differ, values, strict=True)]
            said = said if len(said) <= SAID else [*said[:SAID], f"and {len(said) - SAID} more"]
            label = ", ".join([base, *said])
            while taken.setdefault(label, values) != values:
                label += "'"
            found[id(runs[i])] = label
    return found


def method_of(run: RunFiles) -> str:
    """Its method and task."""
    kind = run.evaluation.get("method") or run.config.get("kind") or "unknown"
    return f"{kind}, {run.evaluation.get('env_id') or run.config.get('env_id') or 'unknown task'}"


def settings_of(run: RunFiles) -> dict[str, str]:
    """What was asked for, by its path; what is off is left away, as an older run has not heard of it."""
    kept = {name: value for name, value in run.config.items() if name not in APART}
    if source := run.config.get("run"):
        # a reward of another method is another thing, one of another seed is not
        kept["reward of"] = re.sub(r"-?s\d+$", "", PurePath(str(source)).name)
        # g and f of one discriminator are two
        kept["reward paid"] = run.paid.get("reward_map")
    return dict(_flat(kept, ""))


def _flat(settings: Mapping[str, Any], where: str) -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    for name, value in settings.items():
        if isinstance(value, Mapping):
            found += _flat(value, f"{where}{name}.")
        elif value:
            found.append((f"{where}{name}", value if isinstance(value, str) else json.dumps(value)))
    return found
