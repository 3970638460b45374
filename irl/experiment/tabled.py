"""`irl bench table NAME`: what the results of a grid come to."""

import sys
from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from irl.bench.cells import Cell, expand
from irl.bench.comparable import comparable
from irl.bench.figure import curves
from irl.bench.grid import Grid, find_grid, read_grid
from irl.bench.markdown import section, summary
from irl.bench.results import read_results
from irl.bench.written import write_part
from irl.core import files
from irl.core.errors import UserError
from irl.experiment.benched import RESULTS

FIGURE = "curves.svg"


@dataclass(frozen=True)
class BenchTable:
    """Tables of a grid's results, from their JSON: averages with intervals, every run, which is better."""

    grid: tyro.conf.Positional[str]
    """A grid, as for irl bench, or a folder of results."""
    results: Path = RESULTS
    """Where the results are, in a folder called as the grid is."""
    write: bool = False
    """Put the tables into --into, the figure beside the results, a summary into --readme if it has marks."""
    into: Path = RESULTS.parent / "RESULTS.md"
    """File of results; the part between the grid's marks is replaced, or begun at its end."""
    readme: Path = Path("README.md")
    """File with a summary between marks called `<grid> summary`."""


def bench_table(command: BenchTable) -> None:
    """Print the tables, and with --write put them where they belong."""
    grid, cells, folder = _named(command)
    name = folder.name
    results, notes = comparable(read_results(folder, cells), cells)
    said = section(name, results, grid, cells, notes)
    Console().print(said, highlight=False, markup=False, soft_wrap=True)
    if not command.write:
        return
    files.write_bytes(figure := folder / FIGURE, curves(results).encode())
    write_part(command.into, name, said, begin=True)
    at = figure.resolve()
    root = command.readme.resolve().parent
    shown = at.relative_to(root).as_posix() if at.is_relative_to(root) else str(figure)
    if write_part(command.readme, f"{name} summary", summary(name, results, grid, shown), begin=False):
        print(f"written: {command.readme}", file=sys.stderr)
    print(f"written: {command.into}, {figure}", file=sys.stderr)


def _named(command: BenchTable) -> tuple[Grid | None, list[Cell], Path]:
    """The grid with its cells and the folder of its results; no grid where only the folder is there."""
    folder = command.results / Path(command.grid).stem
    try:
        grid = read_grid(find_grid(command.grid))
    except UserError:
        # results from before there were grids, or of a grid that is somebody else's
        if command.grid.endswith(".toml") or not folder.is_dir():
            raise
        return None, [], folder
    return grid, expand(grid), folder
