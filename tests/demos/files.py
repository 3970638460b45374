"""Files of demonstrations as other tools write them, of the point mass and of CartPole."""

import csv
from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np

from irl.core.types import Episode

Arrays = dict[str, np.ndarray]


def flat(episodes: Sequence[Episode]) -> Arrays:
    """One row a step, under D4RL's names."""
    last = [np.arange(len(e)) == len(e) - 1 for e in episodes]
    return {
        "observations": np.concatenate([e.obs[:-1] for e in episodes]),
        "actions": np.concatenate([e.action for e in episodes]),
        "rewards": np.concatenate([e.reward for e in episodes]),
        "terminals": np.concatenate([end & e.terminated for end, e in zip(last, episodes, strict=True)]),
        "timeouts": np.concatenate([end & e.truncated for end, e in zip(last, episodes, strict=True)]),
        "next_observations": np.concatenate([e.obs[1:] for e in episodes]),
    }


def with_ids(arrays: Arrays) -> Arrays:
    """The same with a number for each episode and step, and without flags."""
    ends = arrays["terminals"] | arrays["timeouts"]
    ids = np.concatenate([[0], np.cumsum(ends)[:-1]])
    steps = np.concatenate([np.arange((ids == i).sum()) for i in np.unique(ids)])
    return {k: v for k, v in arrays.items() if k not in ("terminals", "timeouts")} | {
        "episode_ids": ids,
        "steps": steps,
    }


def write_npz(path: Path, arrays: Arrays) -> Path:
    np.savez_compressed(path, allow_pickle=False, **arrays)
    return path


def write_csv(path: Path, arrays: Arrays) -> Path:
    """With Python's csv, one line a step: obs_0, obs_1, ..., True and False for flags."""
    short = {"observations": "obs", "actions": "action", "next_observations": "next_obs"}
    columns = {}
    for name, values in arrays.items():
        if values.ndim == 1:
            columns[name] = values
        else:
            columns |= {f"{short[name]}_{i}": values[:, i] for i in range(values.shape[1])}
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(values.tolist() for values in columns.values()), strict=True))
    return path


def write_d4rl(path: Path, arrays: Arrays) -> Path:
    """As D4RL's own generation scripts write: float32, gzip, infos and metadata in groups."""
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            kind = np.bool_ if values.dtype == bool else np.float32
            file.create_dataset(name, data=values.astype(kind), compression="gzip")
        n = len(arrays["observations"])
        file["infos/qpos"] = np.zeros((n, 6), np.float32)
        file["infos/x_position"] = np.arange(n, dtype=np.float32)
        file["infos/action_log_probs"] = np.zeros(n, np.float32)
        file["metadata/algorithm"] = np.bytes_("SAC")
        file["metadata/policy/fc0/weight"] = np.zeros((4, 4))
    return path
