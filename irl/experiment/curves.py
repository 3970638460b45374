"""Curves for TensorBoard, in the run folder's tensorboard/."""

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

    with SummaryWriter(str(run / "tensorboard"), purge_step=start + 1) as writer:

        def draw(row: Row) -> None:
            steps = row["env_steps"]
            assert steps is not None
            for name, value in row.items():
                if value is not None and name not in ("round", "env_steps"):
                    writer.add_scalar(name, value, int(steps))

        yield draw
