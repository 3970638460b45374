"""The reward's part of `evaluation.json`: held against the hand-written one, and against its own past."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from irl.algorithms.probe import STRATA, Probe, read
from irl.core import statistics
from irl.core.rng import stream
from irl.diagnostics.agreement import per_episode, per_step
from irl.diagnostics.drift import split
from irl.diagnostics.stack import read as read_anchored
from irl.diagnostics.stack import read_episodes
from irl.rewards.learned import LearnedReward
from irl.rewards.mujoco import HandWritten

SCATTER = 3000
"""Steps that the report draws, at most."""


def judge_reward(reward: LearnedReward, probe: Probe, seed: int) -> dict[str, Any]:
    """Agreement with the hand-written reward, separation of expert and policy, means by stratum.

    Over all strata a correlation is mostly their order, which is easy; within one it is the reward's detail.
    `auroc` is of the logit (of AIRL: f), whatever the reward pays.
    """
    hand_written = HandWritten()
    learned = {name: read(reward, probe.steps[name]) for name in STRATA}
    truth = {name: read(hand_written, probe.steps[name]) for name in STRATA}
    steps = per_step(probe.stacked(learned), probe.stacked(truth))
    every_episode = [episode for name in STRATA for episode in probe.episodes[name]]
    episodes = per_episode(read_episodes(reward, every_episode), read_episodes(hand_written, every_episode))
    with torch.no_grad():
        logits = {name: reward.logits(probe.steps[name]).double().numpy() for name in STRATA}
    known = all(np.isfinite(values).all() for values in truth.values())
    return {
        "pearson": finite(steps.pearson),
        "pearson_reason": steps.reason,
        "spearman": finite(steps.spearman),
        "spearman_reason": steps.reason,
        "episode_pearson": finite(episodes.pearson),
        "episode_pearson_reason": episodes.reason,
        "episode_spearman": finite(episodes.spearman),
        "episode_spearman_reason": episodes.reason,
        "auroc": finite(statistics.auroc(logits["expert"], logits["policy"])),
        "steps": steps.n,
        "episodes": episodes.n,
        "strata": {
            # with the absorbing state at 0, as wherever else the report shows what a step pays
            name: _stratum(read_anchored(reward, probe.steps[name]), truth[name])
            for name in STRATA
        },
        "scatter": _scatter(learned, truth if known else None, seed),
        "notes": [],
    }


def judge_drift(rewards: Mapping[int, LearnedReward], probe: Probe) -> dict[str, Any]:
    """How the reward moved from snapshot to snapshot, read on the same steps every time.

    `path` is the sum so far of the root mean squared changes: how far it walked, whatever the way.
    """
    readings = [{name: read(reward, probe.steps[name]) for name in STRATA} for reward in rewards.values()]
    at = list(rewards)
    changes, path = [], 0.0
    for i in range(1, len(at)):
        moved = split(probe.stacked(readings[i - 1]), probe.stacked(readings[i]))
        path += math.sqrt(moved.total)
        shares = {name: finite(share) for name, share in moved.shares.items()}
        changes.append({"from": at[i - 1], "to": at[i], **asdict(moved), "shares": shares, "path": path})
    return {
        "snapshots": at,
        "auroc": [finite(statistics.auroc(r["expert"], r["policy"])) for r in readings],
        "strata": {
            name: {
                label: [float(np.quantile(r[name], q)) for r in readings]
                for label, q in (("median", 0.5), ("p10", 0.1), ("p90", 0.9))
            }
            for name in STRATA
        },
        "changes": changes,
        "notes": [
            "The reward before the learner's scaling; AUROC is by it, of the final policy against the expert."
        ],
    }


def finite(value: float) -> float | None:
    """The number, or None where it is not one: JSON has no NaN."""
    return value if math.isfinite(value) else None


def _stratum(learned: Float[np.ndarray, "B"], truth: Float[np.ndarray, "B"]) -> dict[str, Any]:
    return {
        "mean": float(learned.mean()),
        "std": float(learned.std()),
        "steps": len(learned),
        "hand_written_mean": finite(float(truth.mean())),
        "pearson": finite(per_step(learned, truth).pearson),
    }


def _scatter(
    learned: dict[str, np.ndarray], truth: dict[str, np.ndarray] | None, seed: int
) -> dict[str, Any]:
    """The same number of steps of each stratum, to draw."""
    size = min(SCATTER // len(STRATA), *(len(values) for values in learned.values()))
    chosen = {name: stream(seed, f"scatter {name}").permutation(len(learned[name]))[:size] for name in STRATA}

    def column(values: dict[str, np.ndarray]) -> list[float]:
        return np.concatenate([values[name][chosen[name]] for name in STRATA]).round(5).tolist()

    return {
        "learned": column(learned),
        "hand_written": column(truth) if truth is not None else None,
        "stratum": [name for name in STRATA for _ in range(size)],
    }
