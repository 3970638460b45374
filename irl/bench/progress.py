"""How far a running cell is, read off its run folder."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from irl.bench.cells import Cell
from irl.policies.card import Card, normalised_score

TAIL = 64_000
"""Bytes of metrics.jsonl that are read: a few hundred lines, among which is an evaluation."""


@dataclass(frozen=True)
class Progress:
    """Steps done, how fast, and the score of the last evaluation where there was one."""

    steps: int = 0
    steps_per_s: float | None = None
    score: float | None = None
    """The return, where no expert of the task is known."""


def progress_of(cell: Cell, runs: Path, card: Card | None) -> Progress:
    """What the run has written; nothing where its folder cannot be seen from here."""
    rows = _last_rows(runs / cell.name / "metrics.jsonl")
    if not rows:
        return Progress()
    steps, wall_s = rows[-1]["env_steps"], rows[-1]["wall_s"]
    returns = [row["eval_return_mean"] for row in rows if row.get("eval_return_mean") is not None]
    score = returns[-1] if returns else None
    if score is not None and card is not None:
        score = normalised_score(score, card.random_return_mean, card.measured.return_mean)
    return Progress(steps, steps / wall_s if wall_s else None, score)


def _last_rows(path: Path) -> list[dict[str, Any]]:
    try:
        with path.open("rb") as file:
            file.seek(max(path.stat().st_size - TAIL, 0))
            lines = file.read().splitlines()
    except OSError:
        return []
    rows = []
    for line in lines:
        try:
            row = json.loads(line)
        except ValueError:
            # the first is cut off where the file is longer, the last where it is being written
            continue
        if isinstance(row, dict) and {"env_steps", "wall_s"} <= set(row):
            rows.append(row)
    return rows
