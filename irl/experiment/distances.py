"""The `distances` of evaluation.json: the learned reward against the hand-written one, on the base probe.

Only the base strata count, which every run of a task shares, so that the numbers of two runs can be compared;
the run's own policies are read stratum by stratum beside them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from irl.algorithms.probe_set import ProbeSet
from irl.core.types import Episode
from irl.diagnostics.diagnose import Diagnosis, Stratum, diagnose
from irl.diagnostics.distance import Distance
from irl.experiment.judge import finite
from irl.rewards import velocity
from irl.rewards.learned import LearnedReward
from irl.rewards.mujoco import HandWritten

RECORDED = "EPIC is taken against the hand-written reward's form in velocities (irl.rewards.velocity)."


def judge_distances(
    reward: LearnedReward,
    base: ProbeSet,
    own: Mapping[str, Sequence[Episode]],
    named: Sequence[str],
    seed: int,
) -> dict[str, Any]:
    """Distances over the base probe, and within each of its strata and of `own`.

    Raises:
        UserError: EPIC is asked for on a task whose reward has no form in velocities.
    """
    gamma, truth = reward.spec.gamma, HandWritten()
    recorded = [name for name in named if name != "epic"]
    found = diagnose(reward, truth, base, gamma=gamma, named=recorded, seed=seed)
    others = list(found.references)
    notes = [f"{name}: {words}." for name, words in base.about.items() if "no medium" in words]
    if "epic" in named:
        form = velocity.of_task(base.env_id)
        epic = diagnose(reward, form, base, gamma=gamma, ns=(1,), named=("epic",), seed=seed)
        others += epic.references
        notes.append(RECORDED)
    strata = dict(found.strata)
    if own:
        every = diagnose(reward, truth, {**base, **own}, gamma=gamma, ns=(headline_n(found),), seed=seed)
        strata |= {name: every.strata[name] for name in own}
    return {
        "probe_sha256": base.base_sha256,
        "gamma": gamma,
        "steps": found.steps,
        "episodes": found.episodes,
        "headline": as_json(found.headline),
        "curve": [as_json(d) for d in found.curve],
        "references": [as_json(d) for d in others],
        "strata": {name: _stratum(s) for name, s in strata.items()},
        "notes": notes,
    }


def headline_n(found: Diagnosis) -> int:
    """Steps of the headline's segments."""
    return found.headline.n or 1


def as_json(distance: Distance) -> dict[str, Any]:
    """A distance with None for NaN."""
    shown = {k: finite(v) if isinstance(v, float) else v for k, v in asdict(distance).items()}
    return shown | {"distinguishable": distance.distinguishable}


def _stratum(stratum: Stratum) -> dict[str, Any]:
    shown = {k: getattr(stratum, k) for k in ("steps", "episodes", "covered")}
    return as_json(stratum.distance) | shown
