"""A process on a leash goes with the one that started it, even where that one is killed outright."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from irl.bench.leash import script
from irl.bench.processes import Processes

SLEEPER = "import time; print('up', flush=True); time.sleep(60)"
MASTER = """
import sys
from pathlib import Path
from irl.bench.processes import Processes
Processes().run(sys.argv[2:], Path(sys.argv[1]))
"""


def wait_for(condition, seconds: float = 120.0) -> bool:
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return bool(condition())


def children(pid: int) -> list[int]:
    said = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True)
    return [int(word) for word in said.stdout.split()]


def is_alive(pid: int) -> bool:
    said = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
    return bool(said.stdout.strip()) and not said.stdout.startswith("Z")


def of_irl(folder: Path) -> tuple[str, ...]:
    return (sys.executable, "-c", f"from irl.bench.leash import follow; follow(); {SLEEPER}")


def of_others(folder: Path) -> tuple[str, ...]:
    (path := folder / "sleeper.py").write_text(SLEEPER)
    return script(Path(sys.executable), path, ())


@pytest.mark.parametrize("words", [of_irl, of_others])
def test_a_killed_worker_leaves_nothing_running(tmp_path: Path, words: Any) -> None:
    log = tmp_path / "log"
    master = subprocess.Popen([sys.executable, "-c", MASTER, str(log), *words(tmp_path)])
    try:
        assert wait_for(lambda: log.is_file() and log.read_text() == "up\n")
        (child,) = children(master.pid)
        assert is_alive(child)
    finally:
        os.kill(master.pid, signal.SIGKILL)
        master.wait()
    assert wait_for(lambda: not is_alive(child), 10.0)


def test_a_script_on_a_leash_sees_what_it_would_see_without(tmp_path: Path) -> None:
    (tmp_path / "statistics.py").write_text("HERE = 1")
    said = "import sys, statistics; print(__name__, sys.argv, sys.path[0], statistics.HERE)"
    (path := tmp_path / "a.py").write_text(said)
    led = script(Path(sys.executable), path, ("x", "--y"))
    plain = (sys.executable, str(path), "x", "--y")
    # they hold the other end of the leash until it ends
    assert [Processes().run(words, tmp_path / f"{i}.log") for i, words in enumerate((led, plain))] == [0, 0]
    seen = [(tmp_path / f"{i}.log").read_text() for i in (0, 1)]
    assert seen[0] == seen[1] == f"__main__ {[str(path), 'x', '--y']} {tmp_path} 1\n"


def test_a_command_has_one_thread_a_log_and_a_status(tmp_path: Path) -> None:
    said = "import os; print(os.environ['OMP_NUM_THREADS']); raise SystemExit(3)"
    processes, log = Processes(), tmp_path / "logs" / "a.log"
    assert processes.run([sys.executable, "-c", said], log) == 3
    assert processes.run([sys.executable, "-c", "import os; os.kill(os.getpid(), 9)"], log) == -9
    assert log.read_text() == "1\n"
    processes.stop()
    assert processes.run([sys.executable, "-c", "print('begun')"], log) == -signal.SIGTERM
    assert log.read_text() == "1\n"
