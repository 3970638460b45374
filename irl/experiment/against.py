"""The learned reward against the hand-written one, to draw: counts, lines, and where they differ most."""

from dataclasses import asdict
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import stream
from irl.diagnostics import val
from irl.diagnostics.hexagons import Comb, comb, count
from irl.diagnostics.lines import line
from irl.diagnostics.segments import segments
from irl.diagnostics.stack import Stack
from irl.experiment.judge import finite

ACROSS = 36
"""Hexagons over the width."""
ROWS, EACH = 12, 2
"""Steps in the table of residuals, and of one episode."""


def against(left: val.Canonical, n: int, seed: int) -> dict[str, Any]:
    """Honeycomb and lines of single steps, and of segments of `n` steps with the value functions off."""
    of = left.columns
    layout, last = of.steps.layout, of.asked
    sums = segments(left.errors, layout, of.gamma, n)
    steps = (of.raw[:, 0], of.raw[:, last], layout.episode)
    over = (sums.values[:, 0], sums.values[:, last], sums.episode)
    return {
        "step": _drawn(*steps, of.steps, seed),
        "segment": _drawn(*over, of.steps, seed) | {"n": n} if len(sums.values) else None,
    }


def _drawn(
    x: Float[np.ndarray, "M"],
    y: Float[np.ndarray, "M"],
    episode: Int[np.ndarray, "M"],
    steps: Stack,
    seed: int,
) -> dict[str, Any]:
    of, rng = comb(x, y, ACROSS), stream(seed, "slopes")
    stratum = steps.layout.stratum[episode]
    strata: dict[str, Any] = {}
    for i, name in enumerate(steps.layout.names):
        mine = stratum == i
        found = line(x[mine], y[mine], episode[mine], rng)
        plain = {key: finite(v) if isinstance(v, float) else v for key, v in asdict(found).items()}
        strata[name] = plain | _hexagons(of, x[mine], y[mine])
        strata[name]["range"] = np.quantile(x[mine], [0.02, 0.98]).tolist() if mine.any() else None
    return {"across": ACROSS, "x": list(of.x), "y": list(of.y), "strata": strata}


def _hexagons(of: Comb, x: Float[np.ndarray, "M"], y: Float[np.ndarray, "M"]) -> dict[str, Any]:
    centres, counts = count(of, x, y)
    drawn = [[float(f"{v:.5g}") for v in column] for column in centres.T.tolist()]
    return {"hex_x": drawn[0], "hex_y": drawn[1], "hex_count": counts.tolist()}


def residuals(
    truth: Float[np.ndarray, "N"], learned: Float[np.ndarray, "N"], steps: Stack, base: ProbeSet
) -> dict[str, Any] | None:
    """The steps whose learned reward is furthest from a line through all; None where there is no line.

    `residual` is in standard deviations of what the line leaves; at most two steps are of one episode, since
    neighbours resemble each other.
    """
    if not (np.std(truth) > 0.0 and np.all(np.isfinite(learned))):
        return None
    slope = float(np.cov(truth, learned, bias=True)[0, 1] / np.var(truth))
    offset = float(np.mean(learned) - slope * np.mean(truth))
    rest = learned - slope * truth - offset
    spread = float(np.std(rest))
    if not spread > 0.0:
        return None
    layout, taken, rows = steps.layout, {}, []
    for i in np.argsort(-np.abs(rest)).tolist():
        episode = int(layout.episode[i])
        if taken.get(episode, 0) == EACH:
            continue
        taken[episode] = taken.get(episode, 0) + 1
        found = {"learned": learned[i], "hand_written": truth[i], "expected": slope * truth[i] + offset}
        found |= {"residual": rest[i] / spread}
        rows.append({k: float(v) for k, v in found.items()} | _step(steps, base, episode, i))
        if len(rows) == ROWS:
            break
    return {"slope": slope, "offset": offset, "std": spread, "rows": rows}


def _step(steps: Stack, base: ProbeSet, episode: int, i: int) -> dict[str, Any]:
    """Which step it is, and everything recorded of it."""
    layout = steps.layout
    name, t = layout.names[layout.stratum[episode]], i - int(layout.start[episode])
    within = episode - int(np.flatnonzero(layout.stratum == layout.stratum[episode])[0])
    played = base[name][within]
    return {
        "stratum": name,
        "episode": within,
        "seed": played.seed,
        "step": t,
        "ends": bool(played.terminated and t == len(played) - 1),
        "terms": {key: float(values[t]) for key, values in played.terms.items()},
        "obs": np.round(played.obs[t], 4).tolist(),
        "action": np.round(played.action[t], 4).tolist(),
    }
