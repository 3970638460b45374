"""A process on a leash goes with the one that started it, even where that one is killed outright."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from irl.bench.processes import Processes

SLEEPER = "import time; from irl.bench.leash import follow; follow(); print('up', flush=True); time.sleep(60)"
MASTER = """
import sys, threading
from pathlib import Path
from irl.bench.processes import Processes
Processes().run([sys.executable, "-c", sys.argv[1]], Path(sys.argv[2]))
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


def test_a_killed_worker_leaves_nothing_running(tmp_path: Path) -> None:
    log = tmp_path / "log"
    master = subprocess.Popen([sys.executable, "-c", MASTER, SLEEPER, str(log)])
    try:
        assert wait_for(lambda: log.is_file() and log.read_text() == "up\n")
        (child,) = children(master.pid)
        assert is_alive(child)
    finally:
        os.kill(master.pid, signal.SIGKILL)
        master.wait()
    assert wait_for(lambda: not is_alive(child), 10.0)


def test_a_command_has_one_thread_a_log_and_a_status(tmp_path: Path) -> None:
    said = "import os; print(os.environ['OMP_NUM_THREADS']); raise SystemExit(3)"
    processes, log = Processes(), tmp_path / "logs" / "a.log"
    assert processes.run([sys.executable, "-c", said], log) == 3
    assert processes.run([sys.executable, "-c", "import os; os.kill(os.getpid(), 9)"], log) == -9
    assert log.read_text() == "1\n"
    processes.stop()
    assert processes.run([sys.executable, "-c", "print('begun')"], log) == -signal.SIGTERM
    assert log.read_text() == "1\n"
