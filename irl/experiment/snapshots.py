"""Which snapshot of a run a command is about: the last one, or the one whose step is typed."""

from pathlib import Path

from irl.core.errors import UserError
from irl.core.records import RunFolder


def snapshot_of(folder: RunFolder, step: int | None) -> tuple[int, Path]:
    """The environment steps and the folder of the snapshot of `step`, of the last one where it is None.

    Raises:
        UserError: there is none.
    """
    if not (snapshots := folder.snapshots()):
        raise UserError(f"{folder.path} has no snapshot yet; a run takes them as it goes on")
    if step is None:
        step = max(snapshots)
    if step not in snapshots:
        there = ", ".join(map(str, snapshots))
        raise UserError(f"{folder.path} has no snapshot of step {step}; choose one of --snapshot {there}")
    return step, snapshots[step]
