"""Parts of a Markdown file that are made, between two comments; the rest is left as it is."""

from pathlib import Path

from irl.core import files
from irl.core.errors import UserError


def marks(name: str) -> tuple[str, str]:
    """The comments around the part of that name."""
    return f"<!-- made by irl bench table: {name} -->", f"<!-- end of {name} -->"


def read_part(document: str, name: str) -> str | None:
    """What stands between the marks; None where there are none.

    Raises:
        UserError: one of them is missing.
    """
    begin, end = marks(name)
    if begin not in document and end not in document:
        return None
    rest = document.partition(begin)[2]
    part, closed, _ = rest.partition(end)
    if not rest or not closed:
        raise UserError(f"of the comments {begin!r} and {end!r} one is missing; put it back, or remove both")
    return part.strip("\n") + "\n"


def with_part(document: str, name: str, part: str) -> str:
    """The document with that part, in its place or at the end."""
    begin, end = marks(name)
    whole = f"{begin}\n\n{part.strip()}\n\n{end}"
    if read_part(document, name) is None:
        return f"{document.rstrip()}\n\n{whole}\n".lstrip()
    before, _, rest = document.partition(begin)
    return before + whole + rest.partition(end)[2]


def write_part(path: Path, name: str, part: str, *, begin: bool) -> bool:
    """Put the part into a file; without `begin` only where its marks are. Whether it was put there."""
    document = path.read_text(encoding="utf-8") if path.is_file() else ""
    if not begin and read_part(document, name) is None:
        return False
    files.write_bytes(path, with_part(document, name, part).encode())
    return True
