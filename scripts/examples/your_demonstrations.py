"""From a file of your own demonstrations to a policy, a reward and a page that judges both.

    python scripts/examples/your_demonstrations.py --folder example

The demonstrations are made here by a controller of one line, because somebody must; from then on it is what
you would type. The same as commands:

    irl demos import cartpole.npz --env-id CartPole-v1 --name irl/cartpole/mine-v0
    irl train gail --env-id CartPole-v1 --demos irl/cartpole/mine-v0 --out run
    irl evaluate run
"""

import json
from dataclasses import dataclass
from pathlib import Path

import gymnasium as gym
import numpy as np
import tyro

from irl.experiment.cli import main

TASK = "CartPole-v1"


@dataclass(frozen=True)
class Example:
    """Demonstrations in an npz, GAIL, evaluation."""

    folder: Path
    """Where everything goes; it must not hold an earlier run."""
    steps: int = 16_384
    """Environment steps; 500 of 500 is reached within these."""
    episodes: int = 6
    """Demonstrations; all but two are learned from."""


def write_demonstrations(path: Path, episodes: int) -> None:
    """Your file: a row a step, and why an episode ended. Any tool that writes arrays will do."""
    env = gym.make(TASK)
    rows: dict[str, list] = {name: [] for name in ("observations", "actions", "rewards", "next_observations")}
    ends: dict[str, list] = {"terminals": [], "timeouts": []}
    for seed in range(episodes):
        obs, _ = env.reset(seed=seed)
        terminated = truncated = False
        while not (terminated or truncated):
            action = int(obs @ np.array([0.1, 0.4, 3.0, 1.0]) > 0)
            after, reward, terminated, truncated, _ = env.step(action)
            for name, value in zip(rows, (obs, action, reward, after), strict=True):
                rows[name].append(value)
            # a fall ends the task; a time limit does not, and a learner must know which it was
            ends["terminals"].append(terminated)
            ends["timeouts"].append(truncated)
            obs = after
    env.close()
    arrays = {name: np.array(values) for name, values in (rows | ends).items()}
    np.savez_compressed(path, allow_pickle=False, **arrays)


def run(example: Example) -> float:
    """Mean return of the learned policy over 20 episodes; 500 is the most there is."""
    example.folder.mkdir(parents=True, exist_ok=True)
    file, out = example.folder / "cartpole.npz", example.folder / "run"
    datasets, demos = str(example.folder / "datasets"), "irl/cartpole/mine-v0"
    write_demonstrations(file, example.episodes)
    main(["demos", "import", str(file), "--env-id", TASK, "--name", demos, "--datasets-root", datasets])
    words = ["--demos", demos, "--datasets-root", datasets, "--demo-episodes", str(example.episodes - 2)]
    main(["train", "gail", "--env-id", TASK, *words, "--steps", str(example.steps), "--out", str(out)])
    main(["evaluate", str(out)])
    return json.loads((out / "evaluation.json").read_text())["policy"]["return_mean"]


if __name__ == "__main__":
    print(f"return {run(tyro.cli(Example)):.1f} of 500")
