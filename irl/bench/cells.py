"""The cells of a grid, and the commands that each is made of."""

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal

from irl.bench.grid import Given, Grid, Part, Peer, Retrain, Train
from irl.core.config import to_json
from irl.core.errors import UserError
from irl.envs.tasks import task_name


@dataclass(frozen=True)
class Cell:
    """One run of a grid."""

    grid: str
    name: str
    """Of its run folder and its result."""
    kind: Literal["train", "retrain", "peer"]
    method: str
    """As the command calls it."""
    arm: str
    """What tables compare: the method and its variant; of a retraining, whose reward it was and when."""
    task: str
    seed: int
    steps: int
    episodes: int
    rate: int
    settings: tuple[str, ...]
    """Words of the command."""
    evaluate: tuple[str, ...] = ()
    """Words of `irl evaluate`."""
    source: str = ""
    """Of a retraining: the cell whose reward it is."""
    share: float = 0.0
    """Of a retraining: which snapshot, by the share of its run's steps."""
    algo: str = ""
    """Of a retraining: who learns."""
    script: str = ""
    """Of a peer's: what its Python runs."""
    source_steps: int = 0
    """Of a retraining: how long the run learned whose reward it is."""
    source_words: tuple[str, ...] = ()
    """Of a retraining: the method of that run, and all that was asked of it."""

    @property
    def words(self) -> tuple[str, ...]:
        """What is asked for, without the places it is read from and written to."""
        if self.kind == "retrain":
            return ("--algo", self.algo, "--steps", str(self.steps), *self.settings)
        rate = ("--demo-rate", str(self.rate)) if self.rate > 1 else ()
        given = ("--env-id", self.task, "--demo-episodes", str(self.episodes), *rate)
        return (*given, "--steps", str(self.steps), "--seed", str(self.seed), *self.settings)


def expand(grid: Grid) -> list[Cell]:
    """Every cell, in the order that the file has them.

    Raises:
        UserError: two would have one name, seeds of one arm would have different settings, or a retraining
            names a run that the grid has not.
    """
    cells: list[Cell] = []
    for part in grid.part:
        for method, task, given, seed in product(part.methods, part.tasks, part.demos, part.seeds):
            cells += _cells(grid, part, method, task, given, seed)
    if twice := [name for name, n in Counter(cell.name for cell in cells).items() if n > 1]:
        raise UserError(
            f"grid {grid.name} has two cells called {twice[0]}; give one of their parts a variant"
        )
    _check_arms(grid.name, cells)
    trained = {cell.name: cell for cell in cells if cell.kind == "train" and cell.method != "bc"}
    return [_of_its_source(cell, trained) if cell.kind == "retrain" else cell for cell in cells]


def _of_its_source(cell: Cell, trained: Mapping[str, Cell]) -> Cell:
    """A retraining that says how the reward came about: from other settings it is another cell."""
    if (source := trained.get(cell.source)) is None:
        raise UserError(
            f"grid {cell.grid} retrains on the reward of {cell.source}, which no part of kind train with "
            f"a reward makes; add it, with the same variant, task, demos and seed"
        )
    return replace(cell, source_steps=source.steps, source_words=(source.method, *source.words))


def _check_arms(name: str, cells: Sequence[Cell]) -> None:
    """Refuse to count as seeds of one arm what differs in more than the seed."""
    first: dict[tuple[str, str, int, int], Cell] = {}
    for cell in cells:
        other = first.setdefault((cell.arm, cell.task, cell.episodes, cell.rate), cell)
        of, and_of = ((c.kind, c.steps, c.settings, c.script) for c in (other, cell))
        if of != and_of:
            said = (f"{c.kind}, {c.steps:,} steps {' '.join((*c.settings, c.script))}" for c in (other, cell))
            raise UserError(
                f"grid {name} has {other.name} ({next(said).strip():.120}) and {cell.name} "
                f"({next(said).strip():.120}), which tables would take for seeds of one method; give one of "
                f"their parts a variant"
            )


def _cells(grid: Grid, part: Part, method: str, task: str, given: Given, seed: int) -> list[Cell]:
    arm = " ".join(filter(None, (method, part.variant)))
    thinned = f"x{given.rate}" if given.rate > 1 else ""
    name = f"{arm.replace(' ', '-')}-{task_name(task)}-d{given.episodes}{thinned}-s{seed}"
    shared = {"grid": grid.name, "method": method, "task": task, "seed": seed, "steps": part.steps}
    shared |= {"episodes": given.episodes, "rate": given.rate, "settings": words(part.settings)}
    if isinstance(part, Retrain):
        return [
            Cell(
                name=f"{name}-{part.algo}-on-{share:.0%}".rstrip("%"),
                kind="retrain",
                arm=f"{part.algo} on {arm} at {share:.0%}",
                source=name,
                share=share,
                algo=part.algo,
                **shared,
            )
            for share in part.shares
        ]
    if isinstance(part, Peer):
        return [Cell(name=name, kind="peer", arm=arm, script=part.script, **shared)]
    assert isinstance(part, Train)
    return [Cell(name=name, kind="train", arm=arm, evaluate=tuple(shlex.split(grid.evaluate)), **shared)]


def words(settings: dict[str, Any]) -> tuple[str, ...]:
    """Settings as the command line takes them.

    >>> words({"learner.lr": 0.001, "learner.hidden": [64, 64], "watch.tensorboard": False})
    ('--learner.lr', '0.001', '--learner.hidden', '64', '64', '--watch.no-tensorboard')
    """
    found: list[str] = []
    for name, value in settings.items():
        if isinstance(value, bool):
            path, _, last = name.rpartition(".")
            found.append(f"--{name}" if value else f"--{path}.no-{last}".replace("--.", "--"))
        else:
            found += [f"--{name}", *(str(item) for item in (value if isinstance(value, list) else [value]))]
    return tuple(found)


LATER = ("source_steps", "source_words")
"""What cells that were written down long ago do not say."""


def completed(written: Any, cell: Cell) -> Any:
    """A cell that was written down, with what it could not say yet as `cell` says it."""
    if not isinstance(written, Mapping):
        return written
    asked = to_json(cell)
    return {**written, **{name: asked[name] for name in LATER if name not in written}}


def only(cells: Sequence[Cell], wanted: Sequence[str]) -> list[Cell]:
    """The cells whose name holds one of the words, and the runs that those retrain on; all without words.

    Raises:
        UserError: a word is in no name.
    """
    if not wanted:
        return list(cells)
    for word in wanted:
        if not any(word in cell.name for cell in cells):
            raise UserError(f"--only {word}: no cell's name has it; a name is like {cells[0].name}")
    chosen = [cell for cell in cells if any(word in cell.name for word in wanted)]
    names = {cell.name for cell in chosen} | {cell.source for cell in chosen}
    return [cell for cell in cells if cell.name in names]
