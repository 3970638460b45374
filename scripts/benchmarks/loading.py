"""How long a million transitions take to load, beside h5py reading the same arrays.

    python scripts/benchmarks/loading.py

A dataset of Hopper's shape, 1000 episodes of 1000 steps of random numbers, is written once into a temporary
folder. Then the two take turns, and the medians are compared. irl also checks the file's digest, every
episode's shape and every number, and makes what it reads float64. Writes results/loading.json.
"""

import json
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import gymnasium as gym
import h5py
import numpy as np
import tyro

from irl.core.provenance import command_line, environment
from irl.core.types import Episode
from irl.demos.hdf5 import DATA
from irl.demos.load import load_demos
from irl.demos.write import Labels, check_target, origin_of, write
from irl.envs.tasks import task_of

RESULTS = Path(__file__).parent / "results" / "loading.json"
TASK, DATASET = "Hopper-v5", "irl/hopper/loading-v0"


@dataclass(frozen=True)
class Settings:
    """How much, and how often."""

    episodes: int = 1000
    """Of 1000 steps each."""
    turns: int = 5
    """Turns of each."""
    out: Path = RESULTS
    """The JSON to write."""


def random_episode(rng: np.random.Generator, steps: int = 1000) -> Episode:
    """An episode of Hopper's shape, with the terms of its reward and the numbers of its infos."""
    task = task_of(TASK)
    assert task is not None
    names = ("x_position", "x_velocity", "z_distance_from_origin")
    return Episode(
        obs=rng.normal(size=(steps + 1, 11)),
        action=rng.uniform(-1.0, 1.0, (steps, 3)).astype(np.float32),
        reward=rng.normal(size=steps),
        terminated=False,
        truncated=True,
        terms={name: rng.normal(size=steps) for name in task.terms.values()},
        infos={name: rng.normal(size=steps) for name in names},
    )


def prepare(root: Path, episodes: int) -> Path:
    """Write the dataset; its file."""
    rng, env = np.random.default_rng(0), gym.make(TASK)
    target = check_target(DATASET, root, overwrite=False)
    played = [random_episode(rng) for _ in range(episodes)]
    write(target, DATASET, root, played, origin_of(env), Labels("random", "", "for timing"))
    env.close()
    return target / "data" / DATA


def read_all(path: Path) -> int:
    """Every array of the file, as h5py gives it; their bytes."""
    held: list[np.ndarray] = []

    def visit(_: str, item: h5py.Dataset | h5py.Group) -> None:
        if isinstance(item, h5py.Dataset):
            held.append(np.asarray(item[()]))

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return sum(array.nbytes for array in held)


def seconds(what: Callable[[], object]) -> float:
    """How long it takes."""
    began = time.perf_counter()
    what()
    return time.perf_counter() - began


def main(settings: Settings) -> None:
    """Write, read in turns, compare."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        path = prepare(root, settings.episodes)
        read_all(path)  # into the system's cache
        took: dict[str, list[float]] = {"h5py": [], "irl": []}
        for _ in range(settings.turns):
            took["h5py"].append(seconds(lambda: read_all(path)))
            took["irl"].append(seconds(lambda: load_demos(DATASET, root=root)))
        size = path.stat().st_size
    medians = {name: round(statistics.median(values), 3) for name, values in took.items()}
    result = {
        "transitions": settings.episodes * 1000,
        "file_mb": round(size / 1e6, 1),
        "seconds": medians,
        "turns": {name: [round(value, 3) for value in values] for name, values in took.items()},
        "ratio": round(medians["irl"] / medians["h5py"], 2),
        "command": f"python scripts/benchmarks/{command_line()}",
        **{k: v for k, v in environment("", "cpu").items() if k != "command"},
    }
    settings.out.write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps({name: result[name] for name in ("transitions", "file_mb", "seconds", "ratio")}))


if __name__ == "__main__":
    main(tyro.cli(Settings))
