"""A cell of `irl bench peer`: the main peer's GAIL or AIRL (imitation 1.0.1) at its tuned settings.

    PEER_PYTHON scripts/benchmarks/peer_cell.py gail Hopper-v5 demonstrations.npz SEED STEPS RUN

Writes RUN/metrics.jsonl as it goes and RUN/peer.json at its end. Begun again it starts anew.
It needs the environment of its own that throughput_peer.py describes, and plays the -v4 tasks.
"""

# pyright: reportMissingImports=false

import importlib.metadata
import json
import platform
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
from throughput_peer import SETTINGS, trainer

EVERY, WATCHED, JUDGED = 20_480, 5, 20
"""Steps between two evaluations, their episodes and those of the last: as `irl train` and `irl evaluate`."""
PACKAGES = ("imitation", "torch", "gymnasium", "mujoco", "stable-baselines3", "numpy")


def returns(policy, task, seeds):
    """Of the deterministic policy."""
    env, found = gym.make(task), []
    for seed in seeds:
        obs, _ = env.reset(seed=seed)
        over, total = False, 0.0
        while not over:
            obs, reward, terminated, truncated, _ = env.step(policy.predict(obs, deterministic=True)[0])
            total, over = total + float(reward), terminated or truncated
        found.append(total)
    return found


def main():
    """Train to the end, with an evaluation now and then, and judge the last policy."""
    method, task, demonstrations, seed, steps, run = sys.argv[1:]
    old, run = task.replace("-v5", "-v4"), Path(run)
    made = trainer(method, old, demonstrations, int(seed))
    began, done, due = time.perf_counter(), 0, EVERY
    with (run / "metrics.jsonl").open("w") as file:
        while done < int(steps):
            made.train(made.gen_train_timesteps)
            done += made.gen_train_timesteps
            row = {"round": done // made.gen_train_timesteps, "env_steps": done}
            if done >= min(due, int(steps)):
                due += EVERY
                row["eval_return_mean"] = float(
                    np.mean(returns(made.gen_algo, old, range(10_000, 10_000 + WATCHED)))
                )
            row["wall_s"] = round(time.perf_counter() - began, 3)
            file.write(json.dumps(row) + "\n")
            file.flush()
    last = returns(made.gen_algo, old, range(20_000, 20_000 + JUDGED))
    found = {
        "env_steps": done,
        "return_mean": float(np.mean(last)),
        "return_std": float(np.std(last)),
        "return_min": min(last),
        "returns": last,
        "settings": SETTINGS[method][task.split("-")[0]],
        "versions": {"python": platform.python_version()}
        | {n: importlib.metadata.version(n) for n in PACKAGES},
    }
    (run / "peer.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
