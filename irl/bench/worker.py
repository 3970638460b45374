"""One cell carried out, from wherever it was left, by commands of irl."""

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from irl.bench import results
from irl.bench.cells import Cell, completed
from irl.bench.leash import PROGRAM, script
from irl.bench.processes import Processes
from irl.core import files
from irl.core.config import to_json
from irl.core.differences import differences
from irl.core.errors import UserError
from irl.core.records import open_run
from irl.demos.load import load_demos
from irl.envs.tasks import task_name
from irl.policies import shelf
from irl.rewards.artefact import WEIGHTS
from irl.rewards.averaged import so_far

DATASET = ("--episodes", "25", "--seed", "0")
"""The expert's episodes, of which each cell draws its own."""
LAST_LINES = 4000
"""Bytes of a log that are looked through for the reason of a failure."""
_one_at_a_time = threading.Lock()
# Minari is told its folder by the environment of the process


@dataclass(frozen=True)
class Places:
    """Where everything is, as full paths: a worker may start in another folder."""

    runs: Path
    """A run folder and a log for each cell."""
    datasets: Path
    peer_python: Path | None = None
    scripts: Path = Path()
    """What the path of a peer's script begins at."""


@dataclass(frozen=True)
class Outcome:
    """What became of a cell."""

    cell: Cell
    result: dict[str, Any] | None = None
    why: str = ""
    """Without a result, the reason."""
    killed: bool = False
    """It was ended from outside and would go on."""


class Failed(Exception):
    """A command did not do what it was for."""

    def __init__(self, why: str, killed: bool = False) -> None:
        super().__init__(why)
        self.killed = killed


def carry_out(cell: Cell, places: Places, processes: Processes) -> Outcome:
    """Train, or go on training, and judge."""
    try:
        begin = {"train": _train, "retrain": _retrain, "peer": _peer}[cell.kind]
        return Outcome(cell, begin(cell, places, processes))
    except Failed as failed:
        return Outcome(cell, why=str(failed), killed=failed.killed)
    except Exception as error:
        # whatever it is: the cells beside this one have nothing to do with it
        return Outcome(cell, why=reason(error))


def reason(error: Exception) -> str:
    """What became of a cell, in one line; with its type where nobody foresaw it."""
    said = " ".join(str(error).split())
    foreseen = isinstance(error, UserError | OSError)
    return said if foreseen and said else f"{type(error).__name__}: {said}".removesuffix(": ")


def _train(cell: Cell, places: Places, processes: Processes) -> dict[str, Any]:
    run = places.runs / cell.name
    _same_cell(cell, places)
    dataset(cell.task, places, processes)
    if (run / "config.json").is_file():
        _irl(cell, places, processes, "train", "--resume", str(run))
    else:
        where = ("--out", str(run), "--datasets-root", str(places.datasets))
        _irl(cell, places, processes, "train", cell.method, *cell.words, *where)
    if not _judged_at_its_end(run):
        _irl(cell, places, processes, "evaluate", str(run), "--frames", "0", *cell.evaluate)
    return results.of_training(cell, run)


def _retrain(cell: Cell, places: Places, processes: Processes) -> dict[str, Any]:
    run, source = places.runs / cell.name, places.runs / cell.source
    _same_cell(cell, places)
    if not (source / "evaluation.json").is_file():
        raise UserError(
            f"the run {cell.source} is not in {places.runs}; train it here, or let every worker see the "
            f"same --runs"
        )
    if not _judged_at_its_end(source):
        raise UserError(
            f"{source / 'evaluation.json'} is not of the run's last snapshot; make it again: irl evaluate "
            f"{source} --frames 0"
        )
    there = open_run(source).snapshots()
    snapshot = min(there, key=lambda step: abs(step - cell.share * max(there)))
    _same_reward(run, there, snapshot)
    if not (run / "retrain.json").is_file():
        if (run / "config.json").is_file():
            _irl(cell, places, processes, "retrain", "--resume", str(run))
        else:
            where = ("--snapshot", str(snapshot), "--out", str(run))
            _irl(cell, places, processes, "retrain", str(source), *where, *cell.words)
    return results.of_retraining(cell, run, source, snapshot)


def _same_reward(run: Path, snapshots: Mapping[int, Path], snapshot: int) -> None:
    """Refuse a retraining that was begun on another reward than the source has at this snapshot by now."""
    result, begun = run / "retrain.json", run / "reward.json"
    if not result.is_file() and not begun.is_file():
        return
    said = files.read_json(result)["reward"] if result.is_file() else files.read_json(begun)
    now: dict[str, Any] = {"env_steps": snapshot, "weights_sha256": _digest(snapshots[snapshot])}
    if "average_over" in said:
        now["average_over"] = {str(at): _digest(of) for at, of in so_far(snapshots, snapshot).items()}
    if changed := differences({name: said.get(name) for name in now}, now):
        raise UserError(
            f"{run} is a retraining on another reward than {snapshots[snapshot] / 'reward'}: "
            f"{'; '.join(changed):.300}; take it away, and it is made again"
        )


def _digest(snapshot: Path) -> str:
    return files.sha256(snapshot / "reward" / WEIGHTS)


def _judged_at_its_end(run: Path) -> bool:
    """Whether its evaluation is of the last snapshot: one may have been made of a run that was half done."""
    if not (path := run / "evaluation.json").is_file():
        return False
    return files.read_json(path).get("env_steps") == max(open_run(run).snapshots(), default=None)


def _peer(cell: Cell, places: Places, processes: Processes) -> dict[str, Any]:
    run = places.runs / cell.name
    _same_cell(cell, places)
    if places.peer_python is None:
        raise UserError("needs a Python of the peer's own: name it with --peer-python")
    dataset(cell.task, places, processes)
    if not (run / "peer.json").is_file():
        arrays = _arrays(cell, places, run)
        words = (cell.method, cell.task, str(arrays), str(cell.seed), str(cell.steps), str(run))
        path, python = places.scripts / cell.script, places.peer_python
        _ended(cell, places, processes, script(python, path, (*words, *cell.settings)))
    return results.of_peer(cell, run)


def dataset(task: str, places: Places, processes: Processes) -> None:
    """The expert's episodes, made by the first cell that needs them."""
    name = task_name(task)
    folder = places.datasets / "irl" / name / "expert-v0"
    log = places.runs / f"dataset-{name}.log"
    with files.held(places.datasets / f".{name}.lock"):
        if (folder / "data").is_dir():
            return
        # as the command would refuse it, without starting one for each cell
        shelf.find(task)
        words = ("demos", "generate", "--env-id", task, *DATASET, "--datasets-root", str(places.datasets))
        if status := processes.run([*PROGRAM, *words], log):
            raise Failed(_reason(log, status), status < 0)


def _arrays(cell: Cell, places: Places, run: Path) -> Path:
    """The episodes that a training of this seed draws, as arrays for those who do not read Minari."""
    with _one_at_a_time:
        name = f"irl/{task_name(cell.task)}/expert-v0"
        episodes = load_demos(name, episodes=cell.episodes, seed=cell.seed, root=places.datasets)
    arrays: dict[str, Any] = {"episodes": len(episodes)}
    for i, e in enumerate(episodes):
        arrays |= {f"obs{i}": e.obs, f"action{i}": e.action, f"reward{i}": e.reward}
        arrays[f"terminal{i}"] = e.terminated
    run.mkdir(parents=True, exist_ok=True)
    np.savez(path := run / "demonstrations.npz", **arrays)
    return path


def _same_cell(cell: Cell, places: Places) -> None:
    """Go on with a run only where it is of this cell; write down what it is of."""
    path, asked = places.runs / f"{cell.name}.cell.json", to_json(cell)
    # without a run it is of one that never began, or was taken away
    begun = path.is_file() and (places.runs / cell.name).exists()
    if begun and (changed := differences(completed(files.read_json(path), cell), asked)):
        raise UserError(
            f"the run {cell.name} was begun as another cell: {'; '.join(changed):.300}; take it out of "
            f"{places.runs}, or give the grid or the part another name"
        )
    files.write_json(path, asked)


def _irl(cell: Cell, places: Places, processes: Processes, *words: str) -> None:
    _ended(cell, places, processes, (*PROGRAM, *words))


def _ended(cell: Cell, places: Places, processes: Processes, words: tuple[str, ...]) -> None:
    log = places.runs / f"{cell.name}.log"
    if status := processes.run(words, log):
        raise Failed(_reason(log, status), status < 0 or processes.stopped)


def _reason(log: Path, status: int) -> str:
    """What a command that failed said last, by its log."""
    if status < 0:
        return f"killed by signal {-status}"
    lines = log.read_bytes()[-LAST_LINES:].decode(errors="replace").splitlines()
    said = [line.removeprefix("irl: ") for line in lines if line.startswith("irl: ")]
    return (said or [line for line in lines if line.strip()] or [f"exit status {status}"])[-1].strip()
