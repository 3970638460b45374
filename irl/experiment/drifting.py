"""What more `drift` of evaluation.json says of a run's snapshots: health, distances, parts, scale, coverage.

Everything is read on the base probe, whose steps are the same for every snapshot, but for the discriminator's
health: that is of demonstrations against fresh episodes of the snapshot's own policy.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from irl.algorithms.probe_set import ProbeSet
from irl.core import statistics
from irl.core.types import Episode, Transitions, from_episodes
from irl.diagnostics import compare, val
from irl.diagnostics.coverage import coverage
from irl.diagnostics.distribution import shift
from irl.diagnostics.drift import split
from irl.diagnostics.health import health
from irl.diagnostics.hygiene import hygiene
from irl.diagnostics.segments import segments
from irl.diagnostics.stack import Stack, read, stack
from irl.diagnostics.steepness import steepness
from irl.diagnostics.trajectory import pair_flips, trajectory
from irl.experiment.distances import as_json
from irl.experiment.judge import finite
from irl.experiment.logits import Snapshot
from irl.experiment.pictured import pictures
from irl.experiment.progress import Report
from irl.rewards.mujoco import HandWritten

RANKED = 2000
"""Evenly spaced steps that ranks are compared on: Kendall's tau sorts."""
SHIFTED = 10_000
"""Evenly spaced steps that distributions are compared on."""
STEEP = 2000
"""Steps whose gradient is taken."""


@dataclass(frozen=True, eq=False)
class Played:
    """What the discriminators are judged on."""

    train: Transitions
    """The demonstrations that were learned from."""
    held_out: Transitions | None
    fresh: Mapping[int, Sequence[Episode]]
    """Episodes of each snapshot's own policy, drawn from, by step."""


def judge_snapshots(
    snapshots: Mapping[int, Snapshot], base: ProbeSet, played: Played, seed: int, report: Report
) -> dict[str, Any]:
    """Items of `drift`, each a list in the order of the snapshots, or of the pairs of neighbours.

    Args:
        report: called with how many of the 2 S + 1 parts of the work are done, for S snapshots.
    """
    steps, done = stack(base), itertools.count(1)

    def tick(words: str) -> None:
        report(next(done), words)

    rewards = {}
    for at, snapshot in snapshots.items():
        rewards[at] = read(snapshot.reward, steps.batch)
        tick(f"reward at {at}")
    columns = np.column_stack(list(rewards.values()))
    gamma = next(iter(snapshots.values())).reward.spec.gamma
    of = compare.columns(read(HandWritten(), steps.batch), columns, steps, gamma, seed)
    left = val.canonical(of, seed)
    found = _where(left, seed)
    tick("distances")
    healths = []
    for at, snapshot in snapshots.items():
        healths.append(_health(snapshot, played, played.fresh[at]))
        tick(f"discriminator at {at}")
    parts, asked = _parts(snapshots, steps)
    last = from_episodes(list(played.fresh[max(snapshots)]))
    terminated, covered = steps.batch.terminated.numpy(), coverage(steps.batch)
    return {
        **found,
        "health": healths,
        "shift": [_shift(a, b, steps) for a, b in itertools.pairwise(columns.T)],
        "hygiene": [_plain(asdict(hygiene(r, terminated))) for r in columns.T],
        "moves": [_split_of(a, b) for a, b in itertools.pairwise(columns.T)],
        "parts": parts,
        "normaliser": _normaliser(snapshots, steps),
        "outside": [finite(covered.outside(from_episodes(list(played.fresh[at])))) for at in snapshots],
        "pictures": pictures(
            left, base, {at: s.reward for at, s in snapshots.items()}, last, found["n"], seed
        ),
        "cost": {"rewards": len(steps.batch) * (len(snapshots) + asked)},
    }


def _where(left: val.Canonical, seed: int) -> dict[str, Any]:
    """Where each snapshot is: its distance to the hand-written reward, and to the other snapshots."""
    of = left.columns
    n = val.longest(of.steps.layout)
    sums = segments(left.errors, of.steps.layout, of.gamma, n)
    asked = slice(1, 1 + of.asked)
    moved = trajectory(sums.values[:, asked], sums.values[:, 0], np.max(np.abs(of.usable[:, asked]), axis=0))
    return {
        "n": n,
        "to_truth": [as_json(d) for d in val.distances(left, n, seed)],
        "speed": [finite(v) for v in moved.speed],
        "to_final": [finite(v) for v in moved.to_final],
        "cycling": finite(moved.cycling),
        "matrix": [[finite(v) for v in row] for row in moved.matrix.tolist()],
        "map": [[finite(v) for v in place] for place in moved.map.tolist()],
        "sign_flips": [finite(v) for v in moved.flips],
        "sign_agreement": [finite(v) for v in moved.agreement],
    }


def _health(snapshot: Snapshot, played: Played, fresh: Sequence[Episode]) -> dict[str, Any]:
    """The discriminator on demonstrations against steps of its own policy."""
    policy = from_episodes(list(fresh))
    of_policy, of_train = _logits(snapshot, policy), _logits(snapshot, played.train)
    on_train = health(of_train, of_policy)
    found: dict[str, Any] = {"train": _plain(asdict(on_train)), "held_out": None, "memorised": None}
    if played.held_out is not None:
        on_held_out = health(_logits(snapshot, played.held_out), of_policy)
        found["held_out"] = _plain(asdict(on_held_out))
        found["memorised"] = finite(on_train.auroc - on_held_out.auroc)
    expert = played.held_out if played.held_out is not None else played.train
    both = [expert, policy]
    thinned = [part[torch.from_numpy(_some(len(part), STEEP // 2))] for part in both]
    slopes = np.concatenate([steepness(snapshot.logits, part) for part in thinned])
    found["slope_mean"] = finite(float(np.mean(slopes)))
    found["slope_p99"] = finite(float(np.quantile(slopes, 0.99)))
    found["label_prior"] = 0.5
    return found


def _logits(snapshot: Snapshot, batch: Transitions) -> Float[np.ndarray, "B"]:
    with torch.no_grad():
        return snapshot.logits(batch).double().numpy()


def _shift(before: np.ndarray, after: np.ndarray, steps: Stack) -> dict[str, Any]:
    """How the values moved, over all and by stratum, and how their order did."""
    some = _some(len(before), RANKED)
    most = _some(len(before), SHIFTED)
    stratum = steps.layout.stratum[steps.layout.episode][most]
    old, new = before[most], after[most]
    strata = {
        name: _plain(asdict(shift(old[stratum == i], new[stratum == i])))
        for i, name in enumerate(steps.layout.names)
    }
    return _plain(asdict(shift(old, new))) | {
        "spearman": finite(statistics.spearman(before, after)),
        "kendall": finite(statistics.kendall(before[some], after[some])),
        "pair_flips": finite(pair_flips(before[some], after[some])),
        "strata": strata,
    }


def _parts(snapshots: Mapping[int, Snapshot], steps: Stack) -> tuple[dict[str, Any], int]:
    """The split of each part's change, on the same steps, and how many times a part was asked for."""
    names = list(next(iter(snapshots.values())).parts)
    found = {}
    for name in names:
        values = [read(snapshot.parts[name], steps.batch) for snapshot in snapshots.values()]
        found[name] = [_split_of(a, b) for a, b in itertools.pairwise(values)]
    return found, len(names) * len(snapshots)


def _normaliser(snapshots: Mapping[int, Snapshot], steps: Stack) -> dict[str, Any]:
    """Whether observations were normalised alike in all snapshots, and if not what that moved.

    `frozen` has every snapshot see through the first one's normaliser: what is left is the networks' doing.
    """
    every = list(snapshots.values())
    first = every[0].reward.net.normaliser
    others = [s.reward.net.normaliser for s in every]
    same = all(torch.equal(first.mean, n.mean) and torch.equal(first.var, n.var) for n in others)
    if same:
        return {"moved": False, "frozen": None}
    frozen = [read(s.normalised_by(first).reward, steps.batch) for s in every]
    return {"moved": True, "frozen": [_split_of(a, b) for a, b in itertools.pairwise(frozen)]}


def _split_of(before: Float[np.ndarray, "N"], after: Float[np.ndarray, "N"]) -> dict[str, Any]:
    parts = split(before, after)
    return asdict(parts) | {"shares": _plain(parts.shares)}


def _some(n: int, most: int) -> np.ndarray:
    return np.linspace(0, n - 1, min(most, n)).astype(int)


def _plain(numbers: Mapping[str, Any]) -> dict[str, Any]:
    return {name: finite(v) if isinstance(v, float) else v for name, v in numbers.items()}
