"""Files that are either there whole or not at all.

Everything is written aside, flushed to the disk, and renamed into place.
"""

import fcntl
import hashlib
import json
import os
import shutil
import stat
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from irl.core.errors import UserError


def write_bytes(path: Path, content: bytes) -> None:
    """Replace `path` by `content` in one step: a reader sees the old file or the new one.

    Raises:
        OSError: it cannot be written, e.g. the disk is full; names `path`. Nothing is left behind.
    """
    with _named(path), _parents(path):
        handle, aside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(aside, 0o644)
            os.replace(aside, path)
        except BaseException:
            Path(aside).unlink(missing_ok=True)
            raise


def write_json(path: Path, value: Any) -> None:
    """Replace `path` by indented JSON; NaN and infinity are refused, they are not JSON.

    Raises:
        ValueError: a number is not finite. Write None and say why beside it.
    """
    write_bytes(path, (json.dumps(value, indent=2, allow_nan=False) + "\n").encode())


def read_json(path: Path) -> Any:
    """The content of a JSON file.

    Raises:
        UserError: the file is missing, no file, cut off or not JSON, or names a key twice.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            # a pipe would be waited for, a device could be without end
            raise UserError(f"{path} is not a file; expected JSON")
        return json.loads(path.read_text(encoding="utf-8"), object_pairs_hook=_object)
    except FileNotFoundError as error:
        raise UserError(f"no file {path}") from error
    except UserError:
        raise
    except RecursionError as error:
        raise UserError(f"{path} is not readable JSON (nested too deeply)") from error
    # ValueError: neither JSON nor UTF-8, a number of thousands of digits
    except (OSError, ValueError) as error:
        raise UserError(f"{path} is not readable JSON ({error})") from error


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The content of a TOML file that a user wrote; `what` it is goes into the message.

    Raises:
        UserError: there is none, or it is neither TOML nor UTF-8.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise UserError(f"no {what} file {path}") from error
    # ValueError: neither TOML nor UTF-8
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path} is not readable TOML ({error})") from error


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """A folder to fill, which appears as `path` when the block ends and never if it fails.

    A folder that was there is replaced.
    """
    with _parents(path):
        with _named(path):
            aside = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}."))
        try:
            yield aside
            os.chmod(aside, 0o755)
            if path.exists():
                _replace(path, aside)
            else:
                os.rename(aside, path)
        except BaseException:
            shutil.rmtree(aside, ignore_errors=True)
            raise


def check_writable(path: Path) -> None:
    """Refuse a place where nothing could be written, before the work that would be.

    Raises:
        OSError: names `path`.
    """
    with suppress(_Undone), _named(path), new_folder(path.parent / f".{path.name}.trial"):
        raise _Undone


def check_room(folder: Path, size: int) -> None:
    """Refuse a disk that has no room for `size` bytes: they are written and taken away again.

    For writers that do not survive a full disk. What the system says is free may not be ours.

    Raises:
        OSError: there is no room.
    """
    with tempfile.TemporaryFile(dir=folder) as file:
        for start in range(0, size, 2**20):
            file.write(bytes(min(2**20, size - start)))
        file.flush()
        os.fsync(file.fileno())


class _Undone(Exception):
    """Ends a block of `new_folder` whose folder is not wanted."""


@contextmanager
def held(path: Path) -> Iterator[None]:
    """One process at a time, the others wait; the system lets go when this one dies."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _replace(path: Path, aside: Path) -> None:
    """Put the folder `aside` where `path` is; the old one is moved until the new one has its place."""
    replaced = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}."))
    try:
        os.rename(path, replaced)
        try:
            os.rename(aside, path)
        except BaseException:
            os.rename(replaced, path)
            raise
    except BaseException:
        shutil.rmtree(replaced, ignore_errors=True)
        raise
    shutil.rmtree(replaced)


@contextmanager
def _parents(path: Path) -> Iterator[None]:
    """The folders above `path`, made; those that were not there go again if the block fails."""
    missing = [folder for folder in path.parents if not folder.exists()]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for folder in missing:
            with suppress(OSError):
                folder.rmdir()
        raise


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Names `path` in the system's errors: a failed write names no file, or the one aside."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = sorted({key for key in keys if keys.count(key) > 1})
        raise ValueError(f"named twice: {', '.join(twice)}")
    return found
