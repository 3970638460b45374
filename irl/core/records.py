"""The run folder: everything a run writes, in files that other tools can read.

config.json  environment.json  metrics.jsonl  tensorboard/  snapshots/<steps>/  checkpoint/<steps>/
evaluation.json  report.html
"""

import fcntl
import json
import math
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from irl.core import files, state
from irl.core.errors import UserError
from irl.core.log import Logs
from irl.core.metrics import DECLARED

KEPT_CHECKPOINTS = 2


class RunFolder:
    """One run on disk. Make one with `create`, come back to one with `open_run`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._logs = Logs(path / "checkpoint" / "logs")

    @property
    def config(self) -> dict[str, Any]:
        """What `config.json` holds.

        Raises:
            UserError: it cannot be read, or holds no object.
        """
        content = files.read_json(path := self.path / "config.json")
        if not isinstance(content, dict):
            raise UserError(f"{path}: expected the settings of a run, found a {type(content).__name__}")
        return content

    def metrics(self) -> list[dict[str, Any]]:
        """Every complete line of `metrics.jsonl`; a last line that was cut off is not one.

        Raises:
            UserError: another line is damaged; named by its number.
        """
        path = self.path / "metrics.jsonl"
        lines = path.read_bytes().splitlines() if path.is_file() else []
        rows = [_row(line) for line in lines]
        if rows and rows[-1] is None:
            rows.pop()
        if None in rows:
            raise UserError(
                f"line {rows.index(None) + 1} of {path} is not one that a run writes; take the line out, or "
                f"begin a new run with --config and --out"
            )
        return [row for row in rows if row is not None]

    def append(self, row: Mapping[str, int | float | None]) -> None:
        """Add a line to `metrics.jsonl`; a number that is not finite is written as null.

        Raises:
            KeyError: a name is not declared in `core.metrics`.
        """
        if unknown := sorted(set(row) - set(DECLARED)):
            raise KeyError(f"undeclared metrics {unknown}: declare them in irl.core.metrics")
        clean = {k: v if v is not None and math.isfinite(v) else None for k, v in row.items()}
        with (self.path / "metrics.jsonl").open("a") as file:
            file.write(json.dumps(clean) + "\n")

    def goes_on(self, env_steps: int, made_by: Mapping[str, Any]) -> None:
        """Add to `environment.json`, as `resumed`, what of it is not as it was before this step."""
        if not (path := self.path / "environment.json").is_file():
            return
        content = files.read_json(path)
        if not isinstance(content, dict) or not isinstance(resumed := content.get("resumed", []), list):
            raise UserError(f"{path} is not one that a run writes; take it away, and the run goes on")
        before = dict(content)
        for earlier in resumed:
            before |= earlier if isinstance(earlier, dict) else {}
        # the command is --resume by then, and says nothing of what was asked
        changed = {k: v for k, v in made_by.items() if k != "command" and before.get(k) != v}
        if changed:
            files.write_json(path, {**content, "resumed": [*resumed, {"env_steps": env_steps, **changed}]})

    def forget_rounds_after(self, index: int) -> None:
        """Drop the lines of rounds that a resumed run will write again."""
        kept = [json.dumps(row) + "\n" for row in self.metrics() if row["round"] <= index]
        files.write_bytes(self.path / "metrics.jsonl", "".join(kept).encode())

    @contextmanager
    def snapshot(self, env_steps: int) -> Iterator[Path]:
        """A folder to fill for this step; it appears when it is complete."""
        with files.new_folder(self.path / "snapshots" / f"{env_steps:09d}") as folder:
            yield folder

    def snapshots(self) -> dict[int, Path]:
        """Every snapshot by its environment steps, in order."""
        return _by_steps(self.path / "snapshots")

    def save_checkpoint(self, env_steps: int, content: Any) -> None:
        """Write a checkpoint, then drop all but the newest two."""
        root = self.path / "checkpoint"
        with files.new_folder(root / f"{env_steps:09d}") as folder:
            state.save(folder, content, self._logs)
        there = list(_by_steps(root).values())
        for old in there[:-KEPT_CHECKPOINTS]:
            shutil.rmtree(old)
        kept = there[-KEPT_CHECKPOINTS:]
        self._logs.drop_all_but(segment for path in kept for segment in state.used_segments(path))

    def checkpoints(self) -> dict[int, Path]:
        """Every checkpoint by its environment steps, in order."""
        return _by_steps(self.path / "checkpoint")

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the run: no other process writes into it meanwhile. The system lets go when this one dies.

        Raises:
            UserError: another process holds it.
        """
        with (self.path / ".lock").open("a+") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                file.seek(0)
                owner = file.read().strip() or "unknown"
                raise UserError(
                    f"{self.path} is in use by process {owner}; wait for it, stop it with kill, or choose "
                    f"another folder with --out"
                ) from None
            file.truncate(0)
            file.write(f"{os.getpid()}\n")
            file.flush()
            yield

    def load_checkpoint(self) -> tuple[Any | None, list[str]]:
        """The newest checkpoint that can be read, None when there is none; and what was damaged.

        Raises:
            UserError: there are checkpoints, and none of them can be read.
        """
        damaged: list[str] = []
        for path in reversed(_by_steps(self.path / "checkpoint").values()):
            try:
                return state.load(path, self._logs), damaged
            except UserError as error:
                damaged.append(str(error))
        if damaged:
            raise UserError(f"no checkpoint of {self.path} can be read: {'; '.join(damaged)}")
        return None, damaged


def create(
    path: Path,
    config: Mapping[str, Any],
    environment: Mapping[str, Any],
    more: Mapping[str, Any] | None = None,
) -> RunFolder:
    """A new run folder that says what it will do; it appears with all of that or not at all.

    Args:
        more: other documents to begin with, by file name.

    Raises:
        UserError: the folder holds something already.
    """
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        what = "a run" if (path / "config.json").is_file() else "other files"
        hint = f", or go on with it: irl train --resume {path}" if what == "a run" else ""
        raise UserError(f"{path} already holds {what}; choose another folder with --out{hint}")
    documents = {"config.json": config, "environment.json": environment, **(more or {})}
    with files.new_folder(path) as folder:
        for name, content in documents.items():
            files.write_json(folder / name, content)
    return RunFolder(path)


def open_run(path: Path) -> RunFolder:
    """The run in a folder.

    Raises:
        UserError: there is none, or something in it is a link: what is written and deleted here must be here.
    """
    if not (path / "config.json").is_file():
        raise UserError(f"{path} holds no run: there is no {path / 'config.json'}")
    for inside in (*path.iterdir(), *(path / "checkpoint").glob("*")):
        if inside.is_symlink():
            raise UserError(
                f"{inside} is a link to {os.readlink(inside)}; put the real files there, or remove it"
            )
    return RunFolder(path)


def snapshot_steps(total: int, halvings: int = 6) -> list[int]:
    """When to take a snapshot: the start, total / 2^k for k = 6..0, and every quarter.

    >>> snapshot_steps(128, halvings=3)
    [0, 16, 32, 64, 96, 128]
    """
    logarithmic = {total // 2**k for k in range(halvings + 1)}
    quarters = {total * k // 4 for k in range(5)}
    return sorted(logarithmic | quarters)


def _row(line: bytes) -> dict[str, Any] | None:
    """The numbers of a line of `metrics.jsonl`, None where it is none."""
    try:
        row = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return row if isinstance(row, dict) and isinstance(row.get("round"), int) else None


def _by_steps(root: Path) -> dict[int, Path]:
    found = [path for path in root.glob("*") if path.name.isdecimal()]
    return {int(path.name): path for path in sorted(found, key=lambda path: int(path.name))}
