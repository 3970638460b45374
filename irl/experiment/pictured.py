"""The `pictures` of evaluation.json's `drift`: what the report draws, on the base probe.

fan        quantiles of the reward by kind of play, a list a level, an item a snapshot
maps       for each n: distances (VAL) between all snapshots and the hand-written reward, which is the last
           row, and their places in a plane
terms      the weights of the hand-written reward's terms at the snapshots of `steps`
against    learned against hand-written reward, of single steps and of segments with the value functions off:
           counts in a honeycomb and a line for each kind of play
residuals  the steps on which the two differ most
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import stream
from irl.core.types import Episode, Transitions
from irl.diagnostics import val
from irl.diagnostics.segments import segments
from irl.diagnostics.stack import Given, Stack, read
from irl.diagnostics.terms import attribute
from irl.diagnostics.trajectory import trajectory
from irl.experiment.against import against, residuals
from irl.experiment.attributed import as_json
from irl.experiment.judge import finite

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
WEIGHED = 12
"""Snapshots whose terms are weighed, at most: evenly spread, the last one among them."""
REDRAWS = 100
DIGITS = 5
"""Of a number that is only drawn."""


def pictures(
    left: val.Canonical,
    base: ProbeSet,
    snapshots: Mapping[int, Given],
    last: Transitions,
    n: int,
    seed: int,
) -> dict[str, Any]:
    """What is drawn of S snapshots.

    Args:
        left: the hand-written reward first, then the snapshots'.
        snapshots: the reward of each, by step.
        last: steps of the last snapshot's policy.
        n: length of the segments that the rewards are held against each other on.
    """
    of, at = left.columns, list(snapshots)
    final = np.column_stack([read(reward, last) for reward in snapshots.values()])
    rewards = of.raw[:, 1 : 1 + of.asked]
    truth = of.raw[:, 0] if np.all(np.isfinite(of.raw[:, 0])) else None
    return {
        "snapshots": at,
        "fan": _fan(rewards, of.steps, final),
        "maps": [_map(left, m) for m in val.CURVE],
        "terms": _terms(rewards, of.steps, base, at, of.gamma, seed),
        "against": None if truth is None else against(left, n, seed),
        "residuals": None if truth is None else residuals(truth, rewards[:, -1], of.steps, base),
    }


def _fan(rewards: Float[np.ndarray, "N S"], steps: Stack, final: Float[np.ndarray, "F S"]) -> dict[str, Any]:
    strata = {name: rewards[steps.of(name)] for name in steps.layout.names} | {"final policy": final}
    return {
        "levels": list(LEVELS),
        "mean": rounded(np.mean(rewards, axis=0)),
        "std": rounded(np.std(rewards, axis=0)),
        "strata": {name: [rounded(q) for q in np.quantile(r, LEVELS, axis=0)] for name, r in strata.items()},
    }


def _map(left: val.Canonical, n: int) -> dict[str, Any]:
    """Distances over segments of `n` steps, or why there are none."""
    of = left.columns
    sums = segments(left.errors, of.steps.layout, of.gamma, n)
    held, every = len(np.unique(sums.episode)), len(of.steps.layout.length)
    if 2 * held < every:
        return {"n": n, "reason": f"segments of {n} steps fit into {held} of {every} episodes"}
    # the hand-written reward last: the snapshots keep their numbers
    order = [*range(1, 1 + of.asked), 0]
    values = sums.values[:, order]
    moved = trajectory(values, sums.values[:, 0], np.max(np.abs(of.usable[:, order]), axis=0))
    return {
        "n": n,
        "matrix": [rounded(row) for row in moved.matrix],
        "map": [rounded(place) for place in moved.map],
        "reason": None,
    }


def _terms(
    rewards: Float[np.ndarray, "N S"],
    steps: Stack,
    base: ProbeSet,
    at: Sequence[int],
    gamma: float,
    seed: int,
) -> dict[str, Any]:
    episodes: list[Episode] = [episode for name in steps.layout.names for episode in base[name]]
    chosen = np.unique(np.linspace(0, len(at) - 1, min(WEIGHED, len(at))).astype(int))
    found: list[Mapping[str, Any]] = []
    for i in chosen:
        learned = np.split(rewards[:, i], steps.layout.start[1:])
        rng, kind = stream(seed, "terms"), steps.layout.stratum
        try:
            weighed = attribute(episodes, learned, stratum=kind, gamma=gamma, rng=rng, redraws=REDRAWS)
        except ValueError as error:
            return {"reason": str(error)}
        found.append(as_json(weighed))
    spread = {
        name: float(np.std(np.concatenate([e.terms[name] for e in episodes]))) for name in found[0]["weights"]
    }
    return {
        "snapshots": [at[i] for i in chosen],
        "std": {name: finite(value) for name, value in spread.items()},
        "reward_std": rounded(np.std(rewards[:, chosen], axis=0)),
        "weights": {
            name: {key: [row["weights"][name][key] for row in found] for key in _KEPT}
            | {"why_not": found[-1]["weights"][name]["why_not"]}
            for name in found[0]["weights"]
        },
        "explained": [row["explained"] for row in found],
        "shaping": [row["shaping"] for row in found],
        "reason": None,
    }


_KEPT = ("weight", "low", "high", "standardised", "share")


def rounded(values: Float[np.ndarray, "N"]) -> list[float | None]:
    """Numbers to draw; None for what is not finite."""
    return [float(f"{v:.{DIGITS}g}") if np.isfinite(v) else None for v in values.tolist()]
