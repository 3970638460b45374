"""Rows that only ever become more, on disk in pieces: a checkpoint appends, it never rewrites.

A replay of a million transitions is hundreds of megabytes; what came since the last checkpoint is a few.
"""

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from irl.core import files
from irl.core.errors import UserError

Columns = dict[str, Tensor]
Segment = tuple[int, int, str]
"""First row, the row after the last one, and the SHA-256 of the file."""


@dataclass(frozen=True)
class Log:
    """What a state hands over to be appended: rows `start` to `stop`, counted since the run began."""

    name: str
    start: int
    """Rows before this one are not needed any more."""
    stop: int
    read: Callable[[int, int], Columns]
    """The columns of the rows from the first to before the second number."""


@dataclass(frozen=True)
class Rows:
    """What is given back: pieces in order, the first of which may begin before `start`."""

    start: int
    stop: int
    pieces: tuple[tuple[int, Columns], ...]
    """First row and columns of each piece."""


class Logs:
    """The pieces of one run's logs, in a folder of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._known: dict[str, list[Segment]] = {}

    def append(self, log: Log) -> list[Segment]:
        """Write the rows that no piece has yet; every piece that holds a needed row."""
        kept = [s for s in self._known.get(log.name, []) if log.start < s[1] <= log.stop]
        first = kept[-1][1] if kept else log.start
        if first < log.stop:
            content = save({name: column.contiguous() for name, column in log.read(first, log.stop).items()})
            files.write_bytes(self._path(log.name, first, log.stop), content)
            kept.append((first, log.stop, hashlib.sha256(content).hexdigest()))
        self._known[log.name] = kept
        return list(kept)

    def load(self, name: str, start: int, stop: int, segments: Iterable[Segment]) -> Rows:
        """The rows of these pieces, which later calls of `append` go on from.

        Raises:
            UserError: a piece is missing, or is not what was written.
        """
        if not name.isidentifier():
            # it comes from a file, and becomes part of a path
            raise UserError(f"{name!r:.80} is not the name of a log")
        pieces, known = [], []
        for first, last, digest in segments:
            path = self._path(name, int(first), int(last))
            try:
                content = path.read_bytes()
                if hashlib.sha256(content).hexdigest() != digest:
                    raise ValueError("its content is not what was written")
                pieces.append((int(first), load(content)))
            except (OSError, SafetensorError, ValueError) as error:
                raise UserError(f"{path} is damaged ({error})") from error
            known.append((int(first), int(last), str(digest)))
        self._known[name] = known
        return Rows(start, stop, tuple(pieces))

    def drop_all_but(self, used: Iterable[tuple[str, Segment]]) -> None:
        """Delete the pieces that no checkpoint refers to."""
        kept = {self._path(name, first, last).name for name, (first, last, _) in used}
        for path in self.folder.glob("*.safetensors") if self.folder.is_dir() else ():
            if path.name not in kept:
                path.unlink()

    def _path(self, name: str, first: int, last: int) -> Path:
        return self.folder / f"{name}-{first:010d}-{last:010d}.safetensors"
