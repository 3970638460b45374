"""A full disk and a folder that is closed to writing: one line, and nothing half-written."""

import ctypes
import os
import resource
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.experiment.conftest import QUICK, TASK
from tests.malformed.conftest import refused, tree

GENERATE = f"demos generate --env-id {TASK} --dataset-id irl/pointmass/new-v0 --episodes 40 --datasets-root"
TRAIN = " ".join([f"train gail --env-id {TASK}", *QUICK, "--watch.no-tensorboard --out"])
FULL = ("No space left on device", "File too large")
PROGRAM = """
import shlex, sys, tests.pointmass
from irl.experiment.cli import main
for line in sys.stdin:
    try:
        main(shlex.split(line))
    except SystemExit as stopped:
        print("status", stopped.code, file=sys.stderr)
"""
"""Runs each line of its input as one command."""


@pytest.mark.parametrize(
    "words",
    [f"{TRAIN} closed/run", f"{TRAIN} closed/a/b/run", f"{GENERATE} closed", "evaluate closed/kept",
     "train --config run/config.json --out closed/run", f"experts train --env-id {TASK} --out closed/run"],
)  # fmt: skip
def test_a_folder_closed_to_writing(
    words: str, irl: Callable[..., None], world: Path, capfd: pytest.CaptureFixture
) -> None:
    shutil.copytree(world / "run", world / "closed" / "kept")
    closed = [world / "closed", *(p for p in (world / "closed").rglob("*") if p.is_dir())]
    for folder in closed:
        folder.chmod(0o555)
    before = tree(world)
    try:
        with not_above_permissions():
            line = refused(lambda: irl(*words.split()), capfd)
    finally:
        for folder in closed:
            folder.chmod(0o755)
    assert "closed" in line
    assert "Permission denied" in line
    assert "folder that" in line
    assert tree(world) == before


def test_a_run_closed_to_writing_is_not_gone_on_with(
    irl: Callable[..., None], world: Path, capfd: pytest.CaptureFixture
) -> None:
    before = tree(world)
    for path in [world / "run", *(world / "run").rglob("*")]:
        path.chmod(0o555)
    try:
        with not_above_permissions():
            line = refused(lambda: irl("train", "--resume", "run"), capfd)
    finally:
        for path in [world / "run", *(world / "run").rglob("*")]:
            path.chmod(0o755)
    assert "Permission denied" in line
    assert tree(world) == before


@contextmanager
def not_above_permissions() -> Iterator[None]:
    """Root without its right to write what is closed to it, in this thread; others never had it."""
    if os.geteuid() != 0:
        yield
        return
    libc = ctypes.CDLL(None, use_errno=True)
    # linux/capability.h: version 3, this thread; two words each of effective, permitted, inheritable
    header, before = (ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)()
    assert libc.capget(header, before) == 0
    without = (ctypes.c_uint32 * 6)(*before)
    # CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH
    without[0] &= ~0b110
    assert libc.capset(header, without) == 0
    try:
        yield
    finally:
        assert libc.capset(header, before) == 0


DISKS = {
    f"{TRAIN} disks/a/new/run": 8,
    f"{TRAIN} disks/b/run": 30,
    f"{GENERATE} disks/c": 24,
    "evaluate disks/d/run": 24,
}
"""A command, and the KiB of the disk that it is to fill; before it a run of 4 KiB is there or not."""


def test_a_full_disk(world: Path) -> None:
    """On disks of their own where the system lends them, else within a limit on the size of files."""
    disks = [world / "disks" / name for name in "abcd"]
    for disk in disks:
        disk.mkdir(parents=True)
    shutil.copytree(world / "run", disks[3] / "run", ignore=shutil.ignore_patterns("evaluation.json"))
    before = tree(world / "disks")
    commands = "\n".join(DISKS)
    program = shlex.join([sys.executable, "-c", PROGRAM])
    if _lends_disks(disks[0]):
        there = sum(-(-len(content) // 4096) * 4 + 4 for content in before.values())
        sizes = [
            free + (there if disk is disks[3] else 0)
            for disk, free in zip(disks, DISKS.values(), strict=True)
        ]
        mounts = " && ".join(
            f"mount -t tmpfs -o size={size}k none {disk}" for size, disk in zip(sizes, disks, strict=True)
        )
        script = f"cp -r disks kept && {mounts} && cp -r kept/. disks && {program}; cp -r disks after"
        done = _run(["unshare", "-rm", "sh", "-ec", script.replace("; cp", " || true; cp")], world, commands)
    else:
        done = _run([sys.executable, "-c", PROGRAM], world, commands, lambda: _limit_files(2**13))
        shutil.copytree(world / "disks", world / "after")
    said = [line for line in done.stderr.splitlines() if line.startswith(("irl: ", "status"))]
    assert said[1::2] == ["status 2"] * len(DISKS), done.stderr
    assert "Traceback" not in done.stderr
    for line, disk in zip(said[::2], disks, strict=True):
        assert any(error in line for error in FULL), line
        assert f"disks/{disk.name}" in line
    after = tree(world / "after")
    assert {name: after.get(name) for name in before} == before
    # what a training had done is kept, whole; nothing is half-written
    assert [name for name in after if name.rpartition("/")[2].startswith(".") and name[-5:] != ".lock"] == []
    assert not [name for name in after if name.startswith("c/")]


def _run(
    words: list[str], world: Path, given: str, before: Callable[[], None] | None = None
) -> subprocess.CompletedProcess:
    paths = os.pathsep.join([str(Path(__file__).parents[2]), *sys.path])
    environment = {**os.environ, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        words,
        cwd=world,
        env=environment,
        input=given,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=before,
    )


def _lends_disks(at: Path) -> bool:
    if shutil.which("unshare") is None:
        return False
    script = f"mount -t tmpfs -o size=64k none {shlex.quote(str(at))}"
    return (
        subprocess.run(["unshare", "-rm", "sh", "-c", script], capture_output=True, check=False).returncode
        == 0
    )


def _limit_files(size: int) -> None:
    # without it the process would be ended, not told
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
