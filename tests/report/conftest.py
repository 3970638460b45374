"""A synthetic run folder, with the shapes that a run of the quickstart has."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from irl.core.rng import stream
from irl.core.statistics import auroc, pearson, spearman
from irl.diagnostics.drift import split

SNAPSHOTS = [0, 2048, 4096, 8192, 16384, 32768, 61440, 90112, 122880]
N = 600


@pytest.fixture
def evaluation() -> dict[str, Any]:
    """evaluation.json of a run that went well."""
    return an_evaluation()


@pytest.fixture
def run(tmp_path: Path, evaluation: dict[str, Any]) -> Path:
    """A run folder with every file that a report reads."""
    return a_run(tmp_path, evaluation)


def an_evaluation() -> dict[str, Any]:
    """The content of an evaluation.json."""
    rng = stream(0, "evaluation")
    true = {
        "expert": rng.normal(3.2, 0.5, N),
        "policy": rng.normal(3.0, 0.7, N),
        "random": rng.normal(1, 0.3, N),
    }
    rewards = [_learned(true, t / SNAPSHOTS[-1], rng) for t in SNAPSHOTS]
    last = rewards[-1]
    everything = [np.concatenate([r[s] for s in true]) for r in rewards]
    hand_written = np.concatenate(list(true.values()))
    return {
        "format": "irl.evaluation",
        "version": 1,
        "run": "quickstart",
        "method": "gail",
        "env_id": "Hopper-v5",
        "env_steps": SNAPSHOTS[-1],
        "policy": _policy(),
        "references": {
            "expert": {"return_mean": 3654.2, "return_std": 4.1, "source": "shelf hopper/expert"},
            "random": {"return_mean": 18.3, "source": "shelf hopper/expert"},
            "demonstrations": {
                "return_mean": 3651.0,
                "return_std": 3.2,
                "episodes": 4,
                "source": "irl/hopper/expert-v0",
            },
        },
        "reward": {
            "pearson": pearson(everything[-1], hand_written),
            "spearman": spearman(everything[-1], hand_written),
            "pearson_reason": None,
            "episode_pearson": 0.97,
            "episode_spearman": 0.91,
            "auroc": auroc(last["expert"], last["policy"]),
            "steps": 3 * N,
            "episodes": 36,
            "strata": {s: _stratum(last[s], true[s]) for s in true},
            "scatter": {
                "learned": everything[-1].tolist(),
                "hand_written": hand_written.tolist(),
                "stratum": [s for s in true for _ in range(N)],
            },
            "notes": ["the probe holds 600 steps of each kind of play"],
        },
        "drift": {
            "snapshots": SNAPSHOTS,
            "auroc": [auroc(r["expert"], r["policy"]) for r in rewards],
            "strata": {s: _bands([r[s] for r in rewards]) for s in true},
            "changes": [
                {"from": s, "to": t, **vars(split(before, after))}
                for s, t, before, after in zip(
                    SNAPSHOTS, SNAPSHOTS[1:], everything, everything[1:], strict=False
                )
            ],
            "notes": [],
        },
    }


def a_run(place: Path, evaluation: dict[str, Any]) -> Path:
    """A run folder within `place`."""
    folder = place / "quickstart"
    folder.mkdir()
    config = {
        "kind": "gail",
        "env_id": "Hopper-v5",
        "seed": 0,
        "steps": 122880,
        "learner": {"kind": "ppo", "lr": 3e-4},
    }
    environment = {
        "python": "3.11.2",
        "packages": {"torch": "2.13.0", "numpy": "2.4.0", "gymnasium": "1.4.0", "stable-baselines3": "2.8.0"},
        "device": "cpu",
        "threads": 2,
        "git_commit": "dd1a33c0ffee00",
        "git_dirty": False,
        "machine": "x86_64, 2 cores",
        "command": "irl train gail --env-id Hopper-v5 --demos irl/hopper/expert-v0 --demo-episodes 4",
    }
    for name, document in {"config": config, "environment": environment, "evaluation": evaluation}.items():
        (folder / f"{name}.json").write_text(json.dumps(document))
    (folder / "metrics.jsonl").write_text("".join(json.dumps(row) + "\n" for row in _metrics()))
    return folder


def _learned(true: dict[str, np.ndarray], t: float, rng: np.random.Generator) -> dict[str, np.ndarray]:
    gap = {"expert": 0.6, "policy": 0.35 - 0.6 * (1 - t), "random": -1.2}
    return {
        s: 0.8 + (1 - 0.5 * t) * (0.4 * values + gap[s] * min(1, 8 * t)) + rng.normal(0, 0.3, N)
        for s, values in true.items()
    }


def _policy() -> dict[str, Any]:
    returns = stream(1, "evaluation").normal(3477, 12, 20)
    ends = {"return_min": returns.min(), "return_max": returns.max(), "normalised_score": 0.951}
    shape = {"episodes": 20, "length_mean": 1000.0, "length_min": 1000}
    moments = {"return_mean": returns.mean(), "return_std": returns.std(), "normalised_score_reason": None}
    lists = {"returns": returns.tolist(), "lengths": [1000] * 20, "seeds": list(range(20))}
    return {**moments, **ends, **shape, **lists}


def _stratum(learned: np.ndarray, hand_written: np.ndarray) -> dict[str, float]:
    moments = {"mean": learned.mean(), "std": learned.std(), "steps": len(learned)}
    return {**moments, "hand_written_mean": hand_written.mean()}


def _bands(rewards: list[np.ndarray]) -> dict[str, list[float]]:
    levels = {"p10": 10, "median": 50, "p90": 90}
    return {name: [float(np.percentile(r, level)) for r in rewards] for name, level in levels.items()}


def _metrics() -> list[dict[str, Any]]:
    rng, rows = stream(2, "metrics"), []
    for index in range(60):
        steps = 2048 * (index + 1)
        level = 3500 / (1 + np.exp(-(steps - 55_000) / 9_000))
        row: dict[str, Any] = {"round": index, "env_steps": steps, "wall_s": 0.55 * index}
        row["return_mean"] = (
            None if index == 0 else float(max(15, level * 0.93 + rng.normal(0, 0.07 * level)))
        )
        if index % 10 == 9:
            row["eval_return_mean"] = float(level)
        far = np.exp(-steps / 40_000)
        row["discriminator/accuracy_expert"] = float(0.82 + 0.17 * far + rng.normal(0, 0.01))
        row["discriminator/accuracy_policy"] = float(0.80 + 0.19 * far + rng.normal(0, 0.01))
        rows.append(row)
    return rows
