"""A process that goes when the one that started it goes, however that one ended.

A worker that is killed outright cannot stop the training it has started, which would go on, hold its run and
keep the next try out of it. Only the system knows that a parent died, so the parent holds one end of a pipe.
"""

import os
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

PROGRAM = (
    sys.executable,
    "-c",
    "from irl.bench.leash import follow; follow(); from irl.experiment.cli import main; main()",
)
"""`irl` on a leash; it is started with a pipe for its standard input."""

# what `python script words` would see, once this file has been read by its path
_LED = """
import os, runpy, sys
runpy.run_path(sys.argv[1])["follow"]()
sys.argv = sys.argv[2:]
sys.path[0] = os.path.dirname(sys.argv[0])
runpy.run_path(sys.argv[0], run_name="__main__")
"""


def script(python: Path, path: Path, words: Sequence[str]) -> tuple[str, ...]:
    """The command of a script on a leash, by a Python that need not have irl."""
    return (str(python), "-W", "ignore", "-c", _LED, __file__, str(path), *words)


def follow() -> None:
    """From now on, die as soon as nobody holds the other end of standard input."""
    threading.Thread(target=_wait, daemon=True).start()


def _wait() -> None:
    while os.read(0, 4096):
        pass
    # at once, without the checkpoint of a SIGTERM: the next try may be on its way into the run already
    os.kill(os.getpid(), signal.SIGKILL)
