"""The commands of cells as processes of their own, a thread of arithmetic each."""

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


class Processes:
    """Runs commands to their ends, from any thread, until it is told to stop."""

    def __init__(self) -> None:
        self._running: set[subprocess.Popen[bytes]] = set()
        self._lock = Lock()
        self._stopped = False

    @property
    def stopped(self) -> bool:
        return self._stopped

    def run(self, words: Sequence[str], log: Path, env: Mapping[str, str] | None = None) -> int:
        """The exit status, negative for a signal; what was printed is added to `log`."""
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("ab") as file:
            with self._lock:
                if self._stopped:
                    return -signal.SIGTERM
                process = subprocess.Popen(
                    words,
                    stdin=subprocess.PIPE,
                    stdout=file,
                    stderr=subprocess.STDOUT,
                    env={**os.environ, **ONE_THREAD, **(env or {})},
                    # Ctrl-C is for the one who started this; it passes on a SIGTERM
                    start_new_session=True,
                )
                self._running.add(process)
            try:
                return process.wait()
            finally:
                with self._lock:
                    self._running.discard(process)
                assert process.stdin is not None
                process.stdin.close()

    def stop(self) -> None:
        """Ask every process to end, as Ctrl-C would: a training writes its checkpoint first."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                process.send_signal(signal.SIGTERM)
