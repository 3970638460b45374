"""Which results of a folder may stand in one table: those of the grid as it is, by one expert a task."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from irl.bench.cells import Cell, completed
from irl.core.config import to_json
from irl.core.differences import differences
from irl.core.errors import UserError
from irl.policies import shelf
from irl.policies.card import normalised_score

NAMED = 8
"""Results left out that are named; the rest is counted."""
Result = Mapping[str, Any]


def changed(result: Result, cell: Cell) -> list[str]:
    """What the cell that a result is of and a cell of a grid disagree about."""
    return differences(completed(result.get("cell", {}), cell), to_json(cell))


def comparable(results: Sequence[Result], cells: Sequence[Cell]) -> tuple[list[Result], list[str]]:
    """What may be put into one table, and what a reader of it has to know."""
    kept, left_out = of_grid(results, cells)
    found, rescored = by_one_expert(kept)
    named = left_out if len(left_out) <= NAMED else [*left_out[:NAMED], f"and {len(left_out) - NAMED} more"]
    said = [f"Left out, as of no cell of the grid as it is: {' | '.join(named)}."] if left_out else []
    return found, said + rescored


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
        if why or cell is None:
            notes.append(f"{result['file']}: {'; '.join(why):.300}")
        else:
            # nothing differs, so an older one is of all that the cell says
            kept.append({**result, "cell": to_json(cell)})
    if not kept:
        raise UserError(
            f"no result is of a cell of grid {cells[0].grid} as it is now ({notes[0]}); run it again with "
            f"irl bench {cells[0].grid} after taking those away, or put the grid back as it was"
        )
    return kept, notes


def by_one_expert(results: Sequence[Result]) -> tuple[list[Result], list[str]]:
    """The results, each task's scores by one pair of returns, and a sentence where there were several.

    The pair is that of the shelf: an expert may have been replaced between two runs.
    """
    found, notes = [*results], []
    for task in dict.fromkeys(result["task"] for result in results):
        at = [i for i, r in enumerate(results) if r["task"] == task and r["score"] is not None]
        pairs = {_ends(results[i]) for i in at}
        if len(pairs) < 2:
            continue
        experts = " and ".join(sorted("unknown" if e is None else f"{e:.0f}" for _, e in pairs))
        card = shelf.expert_card(task)
        if card is None or any(results[i].get("return_mean") is None for i in at):
            notes.append(
                f"Scores of {task} are by different experts (returns of {experts}): not to be compared."
            )
            continue
        random, expert = card.random_return_mean, card.measured.return_mean
        other = [i for i in at if _ends(results[i]) != (random, expert)]
        for i in other:
            found[i] = _scored_again(results[i], random, expert)
        notes.append(
            f"{task} was scored by different experts (returns of {experts}); here every score is by the one "
            f"on the shelf ({expert:.0f}): {len(other)} of {len(at)} were calculated again. Each run still "
            f"has the demonstrations that it had."
        )
    return found, notes


def _ends(result: Result) -> tuple[float | None, float | None]:
    return result.get("random_return"), result.get("expert_return")


def _scored_again(result: Result, random: float, expert: float) -> Result:
    score = normalised_score(result["return_mean"], random, expert)
    again = {**result, "score": score, "random_return": random, "expert_return": expert}
    # by which expert the run beside it was scored is not written down
    return again | {"score_of_the_run": None} if "score_of_the_run" in again else again
