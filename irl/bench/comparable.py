"""Which results of a folder may stand in one table: those of the grid as it is, by one expert a task."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from irl.bench.cells import Cell
from irl.core.config import to_json
from irl.core.differences import differences
from irl.core.errors import UserError

Result = Mapping[str, Any]


def changed(result: Result, cell: Cell) -> list[str]:
    """What the cell that a result is of and a cell of a grid disagree about."""
    return differences(result.get("cell", {}), to_json(cell))


def of_grid(results: Sequence[Result], cells: Sequence[Cell]) -> tuple[list[Result], list[str]]:
    """The results that are of these cells; of each other one, why it is left out. All without cells.

    Raises:
        UserError: none is of these cells.
    """
    if not cells:
        return [*results], []
    named, kept, notes = {cell.name: cell for cell in cells}, [], []
    for result in results:
        cell = named.get(Path(result["file"]).stem)
        why = ["the grid has no such cell"] if cell is None else changed(result, cell)
        if why:
            notes.append(f"{result['file']}: {'; '.join(why):.300}")
        else:
            kept.append(result)
    if not kept:
        raise UserError(
            f"no result is of a cell of grid {cells[0].grid} as it is now ({notes[0]}); run it again with "
            f"irl bench {cells[0].grid} after taking those away, or put the grid back as it was"
        )
    return kept, notes
