"""irl's side of wallclock.py: GAIL at its defaults, a piece of training and an evaluation for each line read.

python scripts/benchmarks/wallclock_ours.py Hopper-v5 DATASETS_ROOT SEED EPISODES
"""

import json
import sys
import time
from pathlib import Path

import torch

from irl.core.rng import episode_seeds
from irl.demos.load import load_demos
from irl.envs.tasks import task_name
from irl.experiment import build
from irl.experiment.configs import GAILRun
from irl.policies.card import measure


def main() -> None:
    """For each line, steps: train for at least so many, or to the end; print steps, seconds and return."""
    task, root, seed, episodes = sys.argv[1:]
    torch.set_num_threads(1)
    config = GAILRun(env_id=task, seed=int(seed))
    shown = list(load_demos(f"irl/{task_name(task)}/expert-v0", root=Path(root)))
    algorithm = build.imitation(config, shown)
    rounds, seeds = algorithm.rounds(config.steps), episode_seeds(0, "wall clock", int(episodes))
    print("ready", flush=True)
    for line in sys.stdin:
        began, start = time.perf_counter(), algorithm.learner.env_steps
        while algorithm.learner.env_steps - start < float(line):
            if next(rounds, None) is None:
                break
        seconds = time.perf_counter() - began
        row = {"steps": algorithm.learner.env_steps - start, "seconds": seconds}
        measured = measure(task, algorithm.learner.policy(), seeds)
        print(json.dumps(row | {"return_mean": measured.return_mean}), flush=True)


if __name__ == "__main__":
    main()
