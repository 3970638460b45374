"""What an evaluation says of each snapshot, as curves for TensorBoard beside those of training.

The same names as on the page: drift/to_truth, drift/speed, drift/shape, drift/auroc, drift/outside. Curves of
training keep the names of `irl.core.metrics`, which the page quotes.
"""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

FOLDER = "evaluation"
"""Within the run's tensorboard/; of the last evaluation alone."""


def board(run: Path, drift: Mapping[str, Any]) -> None:
    """Write the curves, where the run has a tensorboard/ and its snapshots were judged."""
    place = run / "tensorboard"
    if not place.is_dir() or "health" not in drift:
        return
    from torch.utils.tensorboard import SummaryWriter  # a second to import, and often not wanted

    shutil.rmtree(place / FOLDER, ignore_errors=True)
    with SummaryWriter(str(place / FOLDER)) as writer:
        for name, points in curves_of(drift).items():
            for step, value in points:
                writer.add_scalar(name, value, step)


def curves_of(drift: Mapping[str, Any]) -> dict[str, list[tuple[int, float]]]:
    """The numbers of each curve that are known, with the step of their snapshot."""
    at, later = drift["snapshots"], drift["snapshots"][1:]
    held_out = [row["held_out"] or row["train"] for row in drift["health"]]
    columns = {
        "drift/to_truth": (at, [row["value"] for row in drift["to_truth"]]),
        "drift/speed": (later, drift["speed"]),
        "drift/shape": (later, [row["shares"]["shape"] for row in drift["moves"]]),
        "drift/auroc": (at, [row["auroc"] for row in held_out]),
        "drift/outside": (at, drift["outside"]),
    }
    return {
        name: [(step, value) for step, value in zip(steps, values, strict=True) if value is not None]
        for name, (steps, values) in columns.items()
    }
