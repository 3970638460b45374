"""The main peer's side of wallclock.py: its GAIL, a piece of training and an evaluation for each line read.

PEER_PYTHON scripts/benchmarks/wallclock_peer.py Hopper-v4 demonstrations.npz SEED EPISODES

It needs the environment of its own that throughput_peer.py describes.
"""

# pyright: reportMissingImports=false

import json
import sys
import time

import gymnasium as gym
from throughput_peer import trainer


def mean_return(policy, task, episodes):
    """Of the deterministic policy."""
    env, total = gym.make(task), 0.0
    for seed in range(10_000, 10_000 + episodes):
        obs, _ = env.reset(seed=seed)
        over = False
        while not over:
            obs, reward, terminated, truncated, _ = env.step(policy.predict(obs, deterministic=True)[0])
            total, over = total + float(reward), terminated or truncated
    return total / episodes


def main():
    """For each line, steps: train for at least so many; print steps, seconds and return."""
    task, demonstrations, seed, episodes = sys.argv[1:]
    # its loggers print
    out, sys.stdout = sys.stdout, sys.stderr
    made = trainer("gail", task, demonstrations, int(seed))
    print("ready", file=out, flush=True)
    for line in sys.stdin:
        began, steps = time.perf_counter(), 0
        while steps < float(line):
            made.train(made.gen_train_timesteps)
            steps += made.gen_train_timesteps
        row = {"steps": steps, "seconds": time.perf_counter() - began}
        row["return_mean"] = mean_return(made.gen_algo, task, int(episodes))
        print(json.dumps(row), file=out, flush=True)


if __name__ == "__main__":
    main()
