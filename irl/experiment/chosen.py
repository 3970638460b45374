"""The `chosen` of evaluation.json: the snapshot to keep by what needs no truth, and how good that is."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import torch

from irl.core import statistics
from irl.core.types import Episode, Transitions, from_episodes
from irl.diagnostics.choosing import RULE, Criteria, beside, choose, disagreement
from irl.experiment.judge import finite
from irl.rewards.learned import LearnedReward


def chosen_of(
    loss: Mapping[int, float],
    returns: Sequence[np.ndarray],
    drift: Mapping[str, Any],
    cross: Mapping[str, Any],
) -> dict[str, Any]:
    """The `chosen` of evaluation.json.

    Args:
        loss: of each snapshot that of `losses`.
        returns: of each policy those of `crossplay.returns_of`.
        cross: the `cross_play` of evaluation.json, which alone reads the true return.
    """
    steps = list(loss)
    learned = np.stack([rows[:, 1:].mean(0) for rows in returns], axis=1)
    speed = np.array([np.nan if v is None else v for v in drift["speed"]])
    columns = zip(loss.values(), beside(speed), disagreement(learned), strict=True)
    criteria = {s: Criteria(*map(float, row)) for s, row in zip(steps, columns, strict=True)}
    try:
        choice = choose(criteria)
    except ValueError as failed:
        return {"reason": str(failed)}
    rows = [
        {"step": s, **{k: finite(v) for k, v in asdict(criteria[s]).items()}, "rank": finite(choice.ranks[s])}
        for s in steps
    ]
    compared = _compared(choice.step, steps, drift, cross)
    return {"step": choice.step, "rule": RULE, "criteria": rows, "compared": compared}


def losses(
    rewards: Mapping[int, LearnedReward],
    held_out: Transitions | None,
    fresh: Mapping[int, Sequence[Episode]],
) -> dict[int, float]:
    """Of each snapshot the share of pairs in which a policy's step outranks the expert's."""
    if held_out is None:
        return dict.fromkeys(rewards, float("nan"))
    policies, found = from_episodes([e for episodes in fresh.values() for e in episodes]), {}
    for at, reward in rewards.items():
        with torch.no_grad():
            expert, policy = (reward.logits(batch).double().numpy() for batch in (held_out, policies))
        found[at] = 1.0 - statistics.auroc(expert, policy)
    return found


def _compared(
    step: int, steps: Sequence[int], drift: Mapping[str, Any], cross: Mapping[str, Any]
) -> dict[str, Any] | None:
    """The chosen snapshot among those after step 0, by each measure of the truth; 1 is the best place."""
    measures = {"distance": [of["value"] for of in drift["to_truth"]]}
    if "agreement" in cross:
        measures["kendall"] = [of["kendall"]["value"] for of in cross["agreement"]]
    found: dict[str, Any] = {}
    for name, values in measures.items():
        there = {s: v for s, v in zip(steps, values, strict=True) if s > 0 and v is not None}
        if step not in there:
            continue
        sign = 1 if name == "distance" else -1
        best = min(there, key=lambda s: sign * there[s])
        place = 1 + sum(sign * v < sign * there[step] for v in there.values())
        found[name] = {"chosen": there[step], "last": there.get(steps[-1]), "best": there[best]}
        found[name] |= {"best_step": best, "place": place, "of": len(there)}
    return found or None
