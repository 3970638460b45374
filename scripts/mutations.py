"""Put each known bug back in, and see that a test fails.

    python scripts/mutations.py                 all rows of scripts/mutations.toml
    python scripts/mutations.py --only 9 15     the rows of these bugs
    python scripts/mutations.py --saying TD3    the rows that say so

A row is a patch (file, old text, new text) and the test that must fail with it. Everything happens in a
copy of the checkout in a temporary folder, so an interruption leaves nothing behind. Each test is first run
unpatched and must pass. Exit status 1: a bug was not noticed, or a row no longer applies.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

import tyro

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "scripts" / "mutations.toml"
PASSED, FAILED = 0, 1  # pytest's exit status; any other says that nothing was tested


@dataclass(frozen=True)
class Mutation:
    """One bug, and the test that notices it."""

    bug: int
    """Number of the known bug that it is."""
    what: str
    """What is wrong with the patched line."""
    file: str
    old: str
    """Occurs exactly once in the file."""
    new: str
    test: str
    """As pytest names it."""

    def applied(self, text: str) -> str:
        """The file's text with the bug in it.

        Raises:
            ValueError: the old text is not there, or not only once.
        """
        if (count := text.count(self.old)) != 1:
            raise ValueError(f"{self.file} holds {self.old!r} {count} times, not once")
        return text.replace(self.old, self.new)


@dataclass(frozen=True)
class Settings:
    """Which rows to try."""

    only: tuple[int, ...] = ()
    """Numbers of bugs; all where none is given."""
    saying: tuple[str, ...] = ()
    """Words of which a row's description has one; all where none is given."""

    def wants(self, mutation: Mutation) -> bool:
        """Whether the row is to be tried."""
        said = not self.saying or any(words in mutation.what for words in self.saying)
        return said and (not self.only or mutation.bug in self.only)


def table() -> list[Mutation]:
    """The rows of scripts/mutations.toml."""
    return [Mutation(**row) for row in tomllib.loads(TABLE.read_text(encoding="utf-8"))["mutation"]]


def copy_checkout(to: Path) -> None:
    """Every file of the checkout that git does not ignore, as it is now."""
    listed = subprocess.run(
        ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"),
        cwd=ROOT,
        capture_output=True,
        check=True,
    )
    for name in filter(None, listed.stdout.decode().split("\0")):
        if (ROOT / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, to / name)


def run(tests: list[str], checkout: Path) -> int:
    """Pytest's exit status; nothing is cached, two patches of one second would be taken for one."""
    words = (sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(words, cwd=checkout, env=environment, capture_output=True, check=False).returncode


def verdict(mutation: Mutation, checkout: Path) -> str:
    """`noticed`, or what went otherwise."""
    file = checkout / mutation.file
    before = file.read_text(encoding="utf-8")
    try:
        file.write_text(mutation.applied(before), encoding="utf-8")
        status = run([mutation.test], checkout)
    except ValueError as error:
        return str(error)
    finally:
        file.write_text(before, encoding="utf-8")
    return {FAILED: "noticed", PASSED: "NOT NOTICED"}.get(status, f"NOT TESTED (pytest exit {status})")


def main(settings: Settings) -> None:
    """All rows, one line each."""
    mutations = [m for m in table() if settings.wants(m)]
    with tempfile.TemporaryDirectory() as temporary:
        checkout = Path(temporary)
        copy_checkout(checkout)
        if status := run(sorted({m.test for m in mutations}), checkout):
            raise SystemExit(f"the tests do not pass unpatched (pytest exit {status})")
        verdicts = []
        for m in mutations:
            verdicts.append(verdict(m, checkout))
            print(f"{m.bug:>3}  {m.what:<76}  {m.test.split('/', 1)[1]:<100}  {verdicts[-1]}", flush=True)
    noticed = verdicts.count("noticed")
    print(f"{noticed} of {len(mutations)} bugs noticed")
    raise SystemExit(0 if noticed == len(mutations) else 1)


if __name__ == "__main__":
    main(tyro.cli(Settings))
