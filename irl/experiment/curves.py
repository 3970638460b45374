"""Curves for TensorBoard, in the run folder's tensorboard/."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from irl.core.metrics import Row


@contextmanager
def curves(run: Path, start: int = 0, write: bool = True) -> Iterator[Callable[[Row], None]]:
    """A function that adds a row of metrics to the curves; does nothing unless `write`.

    What an interrupted run drew after `start` steps is not drawn twice.
    """
    if not write:
        yield lambda row: None
        return
    from torch.utils.tensorboard import SummaryWriter  # a second to import, and often not wanted

    folder = str(run / "tensorboard")
    with _said_once(folder), SummaryWriter(folder, purge_step=start + 1) as writer:

        def draw(row: Row) -> None:
            steps = row["env_steps"]
            assert steps is not None
            for name, value in row.items():
                if value is not None and name not in ("round", "env_steps"):
                    writer.add_scalar(name, value, int(steps))

        yield draw


@contextmanager
def _said_once(folder: str) -> Iterator[None]:
    """A disk that fails is said once, with its folder: TensorBoard's own thread prints it too."""

    def hear(failed: threading.ExceptHookArgs) -> None:
        # the writer raises it again in the thread that draws
        if not issubclass(failed.exc_type, OSError):
            before(failed)

    before, threading.excepthook = threading.excepthook, hear
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, folder) from error
    finally:
        threading.excepthook = before
