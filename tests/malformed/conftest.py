"""A folder with a shelf, a dataset and a finished run of the point mass; each test damages its own copy."""

import os
import shutil
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from irl.experiment.cli import main
from tests.experiment.conftest import LOOK, QUICK, TASK, home

__all__ = ["home"]

Tree = dict[str, bytes | str]


@pytest.fixture(scope="session")
def whole(home: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`policies`, `datasets` and an evaluated `run`, all in order."""
    folder = tmp_path_factory.mktemp("whole")
    for name in ("policies", "datasets"):
        shutil.copytree(home / name, folder / name)
    with pytest.MonkeyPatch.context() as patch, _at(folder, patch):
        words = ["--watch.no-tensorboard", "--watch.checkpoint-every-s=0"]
        main(["train", "gail", "--env-id", TASK, "--out", "run", *QUICK, *words])
        main(["evaluate", "run", *LOOK])
    # megabytes, and nothing reads it
    (folder / "run" / "report.html").unlink()
    return folder


@pytest.fixture
def world(whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of `whole` to be in and to damage."""
    folder = tmp_path / "world"
    shutil.copytree(whole, folder)
    with _at(folder, monkeypatch):
        yield folder


@pytest.fixture
def irl(world: Path) -> Callable[..., None]:
    """The command line in `world`."""
    return lambda *words: main([str(word) for word in words])


@contextmanager
def _at(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[None]:
    patch.setenv("IRL_POLICIES_PATH", str(folder / "policies"))
    patch.setenv("MINARI_DATASETS_PATH", str(folder / "datasets"))
    patch.chdir(folder)
    yield


def tree(folder: Path) -> Tree:
    """Everything below a folder: the bytes of files, where links lead, and what the rest is."""
    found: Tree = {}
    for path in folder.rglob("*"):
        name = str(path.relative_to(folder))
        if path.is_symlink():
            found[name] = os.readlink(path)
        elif path.is_file():
            found[name] = path.read_bytes()
        else:
            found[name] = str(stat.S_IFMT(path.stat().st_mode))
    return found


def refused(run: Callable[[], None], capfd: pytest.CaptureFixture) -> str:
    """The one line that a command which exits with 2 says; fails where it says more, or does not."""
    capfd.readouterr()
    with pytest.raises(SystemExit) as stopped:
        run()
    said = capfd.readouterr()
    assert stopped.value.code == 2
    assert said.out == ""
    assert said.err.count("\n") == 1, said.err
    assert said.err.startswith("irl: ")
    assert "Traceback" not in said.err
    return said.err
