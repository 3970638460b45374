"""The `terms` of evaluation.json: what the learned reward pays for, in terms of the hand-written one."""

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import stream
from irl.diagnostics.stack import Given, read, stack
from irl.diagnostics.terms import Attribution, attribute
from irl.experiment.judge import finite


def judge_terms(reward: Given, base: ProbeSet, gamma: float, seed: int) -> dict[str, Any]:
    """Weights of the terms over the base probe, or the reason why there are none.

    A learned reward is read with the absorbing state at 0, as the distances are: what an end costs is in it.
    """
    steps = stack(base)
    episodes = [episode for name in steps.layout.names for episode in base[name]]
    learned = np.split(read(reward, steps.batch), steps.layout.start[1:])
    rng = stream(seed, "terms")
    try:
        found = attribute(episodes, learned, stratum=steps.layout.stratum, gamma=gamma, rng=rng)
    except ValueError as error:
        return {"reason": str(error)}
    return as_json(found) | {"reason": None}


def as_json(found: Attribution) -> dict[str, Any]:
    """The same with None for what is no number; `relative` is over the first weight that can be believed."""
    believed = [w.weight for w in found.terms.values() if w.why_not is None and w.weight]
    unit = abs(believed[0]) if believed else math.nan
    return {
        "weights": {
            name: {k: finite(v) if isinstance(v, float) else v for k, v in asdict(w).items()}
            | {"relative": finite(w.weight / unit)}
            for name, w in found.terms.items()
        },
        "explained": finite(found.explained),
        "shaping": finite(found.shaping),
        "survival_bonus": finite(found.survival_bonus),
        "condition": finite(found.condition),
        "episodes": found.episodes,
    }
