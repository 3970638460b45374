"""Which cell is next, and what becomes of one that was killed or failed."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from irl.bench.cells import Cell
from irl.bench.pool import Runner
from irl.bench.worker import Outcome, reason

TRIES = 5
"""Of a cell that is killed again and again."""
LOOK_S = 1.0
"""Seconds between two looks at what runs."""


@dataclass
class State:
    """Where every cell is."""

    waiting: list[Cell]
    running: dict[str, Cell] = field(default_factory=dict)
    done: set[str] = field(default_factory=set)
    failed: dict[str, str] = field(default_factory=dict)
    """With the reason."""
    tries: dict[str, int] = field(default_factory=dict)


def play(
    state: State,
    runner: Runner,
    keep: Callable[[Outcome], None],
    look: Callable[[State], None],
    asked_to_stop: Callable[[], bool],
) -> None:
    """Carry out every waiting cell that can be; one that fails does not stop the others.

    Args:
        keep: called with each that has a result, before anything else is begun; a cell that it raises over
            has failed.
        look: called now and then.
    """
    while (state.waiting or state.running) and not asked_to_stop():
        _fail_orphans(state)
        for cell in _ready(state)[: max(runner.workers - len(state.running), 0)]:
            state.waiting.remove(cell)
            state.running[cell.name] = cell
            state.tries[cell.name] = state.tries.get(cell.name, 0) + 1
            runner.submit(cell)
        look(state)
        for outcome in runner.finished(LOOK_S) if state.running else ():
            _settle(state, outcome, keep)
    look(state)


def _settle(state: State, outcome: Outcome, keep: Callable[[Outcome], None]) -> None:
    cell = state.running.pop(outcome.cell.name)
    if outcome.result is not None:
        try:
            keep(outcome)
        except Exception as error:
            state.failed[cell.name] = f"its result cannot be kept: {reason(error)}"
        else:
            state.done.add(cell.name)
    elif outcome.killed and state.tries[cell.name] < TRIES:
        state.waiting.insert(0, cell)
    else:
        again = f", {TRIES} times" if outcome.killed else ""
        state.failed[cell.name] = replace(outcome, why=outcome.why + again).why


def _ready(state: State) -> list[Cell]:
    return [cell for cell in state.waiting if not cell.source or cell.source in state.done]


def _fail_orphans(state: State) -> None:
    """A reward that was not learned cannot be retrained on."""
    names = {cell.name for cell in state.waiting} | set(state.running) | state.done
    for cell in [c for c in state.waiting if c.source and c.source not in names]:
        state.waiting.remove(cell)
        state.failed[cell.name] = f"there is no reward: {cell.source} failed"


def outcome_line(state: State) -> str:
    """How many are where."""
    done, running, waiting, failed = map(len, (state.done, state.running, state.waiting, state.failed))
    return (
        f"{done} of {done + running + waiting + failed} done, {running} running, {waiting} waiting, "
        f"{failed} failed"
    )
