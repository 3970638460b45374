"""`irl bench NAME`: every cell of a grid, here or on a Ray cluster."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import tyro
from rich import box
from rich.console import Console
from rich.table import Table

from irl.bench.cells import Cell, expand, only
from irl.bench.cluster import Cluster
from irl.bench.comparable import changed
from irl.bench.estimate import Cost, all_results, costs, makespan, measured
from irl.bench.grid import find_grid, read_grid
from irl.bench.live import duration, live
from irl.bench.pool import Pool, Runner
from irl.bench.results import scored
from irl.bench.schedule import State, play
from irl.bench.worker import Outcome, Places
from irl.core import files
from irl.core.config import check_at_least
from irl.core.errors import UserError
from irl.envs.make import check_module
from irl.experiment.configs import FromDemonstrations
from irl.experiment.play import Interrupted, asked_to_stop
from irl.experiment.retrain import Retrain
from irl.experiment.shelved import cores
from irl.experiment.typed import parsed
from irl.policies import shelf

RESULTS = Path("scripts/benchmarks/results")


@dataclass(frozen=True)
class Bench:
    """Run a grid of methods, tasks, demonstrations and seeds; typed again, it goes on."""

    grid: tyro.conf.Positional[str]
    """A shipped grid (irl/bench/grids), or a TOML file; irl/bench/grid.py shows one."""
    workers: int | None = None
    """Cells at a time, each with one thread; one a core unless given, of the cluster with --ray."""
    ray: str = ""
    """Address of a Ray cluster that runs the cells, or local for one started here; needs irl[ray]. Every
    node has irl, and sees --runs under the same path if a cell is to go on elsewhere."""
    estimate: bool = False
    """Say what is still to do and what it will cost, and run nothing."""
    only: tuple[str, ...] = ()
    """Cells whose name holds one of these, e.g. dac-hopper or s21."""
    peer_python: Path | None = None
    """Python of the environment in which a peer is installed; its cells need one."""
    runs: Path = Path("runs/bench")
    """Where run folders and logs are, in a folder called as the grid is."""
    results: Path = RESULTS
    """Where the results go, as <grid>/<cell>.json."""
    datasets_root: Path | None = None
    """Where the experts' datasets are, or are made; in --runs unless given."""

    def __post_init__(self) -> None:
        if self.workers is not None:
            check_at_least(self, 1, "workers")


def bench(command: Bench) -> None:
    """Run what has no result yet.

    Raises:
        SystemExit: 1, a cell failed.
        Interrupted: the user asked to stop; what ran has a checkpoint.
    """
    path = find_grid(command.grid)
    cells = only(expand(read_grid(path)), command.only)
    _check(cells, path)
    folder = command.results / cells[0].grid
    done = {cell.name for cell in cells if _is_done(cell, folder)}
    ahead = costs([cell for cell in cells if cell.name not in done], measured(all_results(command.results)))
    _say(ahead, len(done), command.workers or cores())
    if command.estimate or not ahead:
        return
    files.check_writable(folder)
    state, places = State([cost.cell for cost in ahead], done=done), _places(command, cells[0].grid)
    runner = _runner(command, places)
    try:
        # after the runner: Ray has handlers of its own
        with asked_to_stop() as asked, live(ahead, places.runs, runner.workers) as look:
            play(state, runner, lambda outcome: _keep(outcome, folder), look, asked)
            stopped = asked()
    finally:
        runner.stop()
    for name, why in state.failed.items():
        print(f"irl: {name}: {why}", file=sys.stderr)
    if stopped:
        print(f"stopped; go on with: irl bench {command.grid}", file=sys.stderr)
        raise Interrupted
    print(f"results: {folder}; tables with: irl bench table {command.grid}", file=sys.stderr)
    if state.failed:
        raise SystemExit(1)


def _check(cells: Sequence[Cell], grid: Path) -> None:
    """Refuse settings that a command would, before anything is run.

    Raises:
        UserError: names the cell, or the grid whose task is of a module that nobody typed.
    """
    for task in dict.fromkeys(cell.task for cell in cells):
        check_module(task, str(grid))
    runs = {run.KIND: run for run in get_args(FromDemonstrations)}
    seen = set()
    for cell in cells:
        if cell.kind == "peer" or (key := (cell.kind, cell.method, cell.settings)) in seen:
            continue
        seen.add(key)
        if cell.method not in runs:
            raise UserError(f"{cell.name}: no method {cell.method!r:.40}; there are {', '.join(runs)}")
        cls = Retrain if cell.kind == "retrain" else runs[cell.method]
        before = ["RUN"] if cell.kind == "retrain" else []
        try:
            parsed(cls, [*before, *cell.words], cell.name)
        except UserError as error:
            raise UserError(f"{cell.name}: {error}") from error


def _is_done(cell: Cell, folder: Path) -> bool:
    """Whether its result is there.

    Raises:
        UserError: it is, of another cell of that name.
    """
    if not (path := folder / f"{cell.name}.json").is_file():
        return False
    if why := changed(files.read_json(path), cell):
        raise UserError(
            f"{path} is the result of another cell: {'; '.join(why):.300}; take it away, or give the "
            f"grid or the part another name"
        )
    return True


def _places(command: Bench, grid: str) -> Places:
    datasets = command.datasets_root or command.runs / "datasets"
    return Places(
        runs=(command.runs / grid).absolute(),
        datasets=datasets.expanduser().absolute(),
        # not resolved: the link is what makes it the Python of its environment
        peer_python=command.peer_python.absolute() if command.peer_python else None,
        scripts=Path.cwd(),
    )


def _runner(command: Bench, places: Places) -> Runner:
    if command.ray:
        return Cluster(command.ray, command.workers, places)
    return Pool(command.workers or cores(), places)


def _keep(outcome: Outcome, folder: Path) -> None:
    assert outcome.result is not None
    card = shelf.expert_card(outcome.cell.task)
    references = (card.random_return_mean, card.measured.return_mean) if card else None
    files.write_json(folder / f"{outcome.cell.name}.json", scored(outcome.result, references))


def _say(ahead: Sequence[Cost], done: int, workers: int) -> None:
    """What is still to do, and the time it takes, as a table."""
    if not ahead:
        print("every cell has its result", file=sys.stderr)
        return
    drawn = Table(box=box.SIMPLE_HEAD, caption_justify="left")
    for name in ("method", "task", "cells", "steps", "steps/s", "core time", "speed is"):
        drawn.add_column(name, justify="left" if name in ("method", "task", "speed is") else "right")
    groups: dict[tuple[str, str], list[Cost]] = {}
    for cost in ahead:
        groups.setdefault((cost.cell.arm, cost.cell.task), []).append(cost)
    for (arm, task), of in groups.items():
        steps = sum(cost.cell.steps for cost in of)
        time = duration(sum(cost.seconds for cost in of))
        drawn.add_row(arm, task, str(len(of)), f"{steps:,}", f"{of[0].steps_per_s:,.0f}", time, of[0].source)
    total = duration(sum(cost.seconds for cost in ahead))
    drawn.caption = (
        f"{len(ahead)} cells to do, {done} done: {total} of training on one core, "
        f"{duration(makespan(ahead, workers))} with {workers} workers; judging comes on top"
    )
    Console(stderr=True).print(drawn)
