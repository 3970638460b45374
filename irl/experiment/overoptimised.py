"""The `proxy_gold` of evaluation.json and retrain.json: a learned return beside the true one over a run."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from jaxtyping import Float

from irl.diagnostics.overoptimisation import FORM, overoptimisation
from irl.experiment.judge import finite

Fell = tuple[float, float] | str
"""Shares of the gain in true return that were lost while the proxy fell and while it rose, one of them 0; or
why that is not known."""


def over_run(
    steps: Sequence[int],
    proxy: Sequence[float],
    gold: Sequence[float],
    error: Float[np.ndarray, "N"] | None = None,
    then: Sequence[float] | None = None,
    floor: float | None = None,
    proxy_error: Float[np.ndarray, "N"] | None = None,
) -> tuple[dict[str, Any], Fell]:
    """What the two returns of a run's policies say, and what was lost again.

    Args:
        error: standard error of each true return, where it is known.
        floor: true return of random actions, which a gain is counted from; the first policy's unless given.
        proxy_error: standard error of each learned return, where it is known.
        then: return under the reward of the policy's own moment; `proxy` is all by one reward.
    """
    at, learned, true = np.array(steps, dtype=np.int64), np.array(proxy, float), np.array(gold, float)
    try:
        found = overoptimisation(at, learned, true, error, floor, proxy_error)
    except ValueError as failed:
        return {"reason": str(failed)}, str(failed)
    columns = {"step": steps, "proxy": proxy, "gold": gold}
    columns |= {} if error is None else {"gold_error": error.tolist()}
    columns |= {} if then is None else {"proxy_then": then}
    content = {
        "points": [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
        "peak_step": steps[found.peak],
        "drop": finite(found.drop),
        "lost": finite(found.lost),
        "gap": finite(found.gap),
        "proxy_rose": found.proxy_rose,
        "decoupling_step": None if found.decoupling is None else steps[found.decoupling],
        "fit": None if found.fit is None else {**asdict(found.fit), "peak": found.fit.peak, "form": FORM},
        "fit_reason": found.fit_reason,
    }
    if not np.isfinite(found.lost):
        return content, "the true return never rose beyond its errors"
    if found.lost and found.proxy_rose is None:
        return content, f"{found.lost:.2f} was lost while the learned return was the same within its errors"
    return content, (0.0, found.lost) if found.proxy_rose else (found.lost, 0.0)
