"""A run folder as a report needs it: what is there, and for what is not, the reason.

Nothing here raises over a missing or damaged file: a report of half a run is better than none.
"""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from irl.core.errors import UserError


@dataclass(frozen=True)
class RunFiles:
    """The files of one run, read; a file that could not be read is empty and has a problem."""

    name: str
    config: Mapping[str, Any]
    environment: Mapping[str, Any]
    metrics: Sequence[Mapping[str, Any]]
    evaluation: Mapping[str, Any]
    problems: Mapping[str, str]
    """File name -> one sentence on why it is empty or cut short."""
    path: Path = Path()
    retrained: Mapping[str, Any] = field(default_factory=dict)
    """retrained.json: several policies trained on this run's frozen rewards."""
    retrain: Mapping[str, Any] = field(default_factory=dict)
    """retrain.json: this run is a policy trained on the frozen reward of another."""
    reward: Mapping[str, Any] = field(default_factory=dict)
    """spec.json of the last snapshot's reward."""
    paid: Mapping[str, Any] = field(default_factory=dict)
    """reward.json: of a retraining, which frozen reward it is paid."""


def read_run(run: Path) -> RunFiles:
    """The files of the run folder `run`.

    Raises:
        UserError: there is no such folder.
    """
    if not run.is_dir():
        raise UserError(f"there is no run folder {run}: give the folder that `irl train` wrote")
    problems: dict[str, str] = {}
    documents = {name: _read_object(run / name, problems) for name in ("config.json", "environment.json")}
    evaluation = _read_object(run / "evaluation.json", problems)
    return RunFiles(
        name=str(evaluation.get("run") or run.resolve().name),
        config=documents["config.json"],
        environment=documents["environment.json"],
        metrics=_read_lines(run / "metrics.jsonl", problems),
        evaluation=evaluation,
        problems=problems,
        path=run,
        retrained=_read_object(run / "retrained.json", {}),
        retrain=_read_object(run / "retrain.json", {}),
        reward=_read_object(last / "reward" / "spec.json", {}) if (last := last_snapshot(run)) else {},
        paid=_read_object(run / "reward.json", {}),
    )


def last_snapshot(run: Path) -> Path | None:
    """The folder of the snapshot with the most steps; None where there is none."""
    found = [p for p in run.glob("snapshots/*") if p.name.isdigit() and p.is_dir()]
    return max(found, key=lambda p: int(p.name), default=None)


def lookup(document: object, path: str) -> Any:
    """What stands at a dotted path, `None` where nothing does."""
    for key in path.split(".") if path else []:
        if not isinstance(document, Mapping):
            return None
        document = document.get(key)
    return document


def number(document: object, path: str) -> float | None:
    """The finite number at a dotted path, `None` where there is none."""
    return finite(lookup(document, path))


def finite(value: object) -> float | None:
    """The value as a float, `None` unless it is a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    # JSON has integers that no float holds
    if abs(value) > sys.float_info.max or math.isnan(value):
        return None
    return float(value)


def column(rows: Sequence[Mapping[str, Any]], x: str, y: str) -> tuple[list[float], list[float]]:
    """The numbers `x` and `y` of the rows that have both."""
    pairs = [(finite(row.get(x)), finite(row.get(y))) for row in rows]
    kept = [(a, b) for a, b in pairs if a is not None and b is not None]
    return [a for a, _ in kept], [b for _, b in kept]


def texts(value: object) -> list[str]:
    """The strings of a list of notes; none where there is no list."""
    return [str(item) for item in value] if isinstance(value, list | tuple) else []


def why_missing(evaluation: Mapping[str, Any], path: str) -> str:
    """The reason that evaluation.json gives for the absence of `path`.

    Looked for in this order: its own `_reason`, that of the measure it is computed with, the same
    one level up, then the notes beside it.
    """
    if not evaluation:
        return "this run has no evaluation yet: `irl evaluate` makes one"
    keys = path.split(".")
    parents = [(lookup(evaluation, ".".join(keys[:i])), keys[i]) for i in reversed(range(len(keys)))]
    for parent, key in parents:
        pearson = key.replace("spearman", "pearson")
        for name in (key, pearson, pearson.removeprefix("episode_")):
            reason = lookup(parent, f"{name}_reason")
            if isinstance(reason, str) and reason:
                return reason
    for parent, _ in parents:
        notes = texts(lookup(parent, "notes"))
        if notes:
            return "; ".join(notes)
    return f"evaluation.json gives neither {path} nor a reason"


def _read_object(path: Path, problems: dict[str, str]) -> dict[str, Any]:
    # a pipe in its place would be waited for
    if not path.is_file():
        problems[path.name] = f"{path.name} is not in the run folder"
        return {}
    try:
        document = json.loads(path.read_text(encoding="utf-8"), parse_constant=lambda _: None)
    except (OSError, ValueError, RecursionError) as error:
        problems[path.name] = f"{path.name} cannot be read: {error}"
        return {}
    if not isinstance(document, dict):
        problems[path.name] = f"{path.name} holds a {type(document).__name__}, not an object"
        return {}
    return document


def _read_lines(path: Path, problems: dict[str, str]) -> list[dict[str, Any]]:
    if not path.is_file():
        problems[path.name] = f"{path.name} is not in the run folder"
        return []
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError) as error:
        problems[path.name] = f"{path.name} cannot be read: {error}"
        return []
    rows, bad = [], 0
    for line in filter(str.strip, lines):
        try:
            row = json.loads(line, parse_constant=lambda _: None)
        except (ValueError, RecursionError):
            row = None
        if isinstance(row, dict):
            rows.append(row)
        else:
            # a run that was killed leaves half a line
            bad += 1
    if bad:
        problems[path.name] = f"{path.name}: {bad} of {bad + len(rows)} lines cannot be read and are left out"
    return rows
