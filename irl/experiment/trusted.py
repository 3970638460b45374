"""What evaluation.json says of trusting a reward: by policies, over the run, what else, what at all.

`cross_play`, `proxy_gold`, `residual`, `ledger`, `chosen`, `verdicts`; each says why where it is not known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import stream
from irl.core.types import Episode, Transitions
from irl.diagnostics import ledger
from irl.diagnostics.hygiene import hygiene
from irl.diagnostics.overoptimisation import standard_errors
from irl.diagnostics.residual import residual
from irl.diagnostics.stack import read, stack
from irl.diagnostics.verdicts import BY_NAME, NAMES, verdicts
from irl.envs.tasks import task_of
from irl.experiment.chosen import chosen_of, losses
from irl.experiment.crossplay import Played, judge_cross_play, returns_of
from irl.experiment.overoptimised import Fell, over_run
from irl.rewards.ensemble import EnsembleNet
from irl.rewards.learned import LearnedReward
from irl.rewards.mujoco import HandWritten
from irl.rewards.shaped import ENTROPIC, ShapedNet

SHOWN = 20
"""Columns of the residual that are written down, the most important first."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What a run's rewards are judged on."""

    rewards: Mapping[int, LearnedReward]
    base: ProbeSet
    played: Played
    held_out: Transitions | None
    fresh: Mapping[int, Sequence[Episode]]
    """Of each snapshot's own policy, drawn from as in training."""


def judge_trust(seen: Seen, drift: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """The parts of evaluation.json that this module names.

    Args:
        drift: that of evaluation.json (`drifting.judge_snapshots`).
    """
    steps, rewards = list(seen.rewards), list(seen.rewards.values())
    returns = [returns_of(player.episodes, rewards) for player in seen.played.players]
    cross = judge_cross_play(returns, steps, seen.played, seed)
    proxy, fell = _proxy_gold(seen.played, returns)
    return {
        "cross_play": cross,
        "proxy_gold": proxy,
        "residual": _residual(rewards[-1], seen.base, seed),
        "ledger": ledger_of(rewards[-1]),
        "chosen": chosen_of(losses(seen.rewards, seen.held_out, seen.fresh), returns, drift, cross),
        "verdicts": [asdict(v) for v in verdicts(*_numbers(steps, drift, seen.base, cross, fell))],
    }


def nothing(reason: str, reward: LearnedReward) -> dict[str, Any]:
    """The same where there is no probe to judge on."""
    why = {"reason": reason}
    parts = dict.fromkeys(("cross_play", "proxy_gold", "residual", "chosen"), why)
    judged = verdicts({}, dict.fromkeys(NAMES, reason))
    return {**parts, "ledger": ledger_of(reward), "verdicts": [asdict(v) for v in judged]}


def ledger_of(reward: LearnedReward) -> dict[str, Any]:
    """What this kind of reward determines, on this task."""
    pays, net = reward.spec.reward_map, reward.net
    # what a mean of several is known to be is what one of them is
    net = net.each[0] if isinstance(net, EnsembleNet) else net
    kind = ledger.RATIO
    if isinstance(net, ShapedNet):
        of_g = ledger.G_STATES if net.spec.sees == "obs" else ledger.G
        kind = {"g": of_g, ENTROPIC: ledger.F_LOG_PI}.get(pays, ledger.F)
    row, task = ledger.LEDGERS[kind], task_of(reward.spec.env_id)
    cannot = list(row.cannot)
    if task is not None and not task.hides.startswith("nothing"):
        cannot.append(f"what the observation hides: {task.hides}")
    return {"kind": kind, "determines": list(row.determines), "cannot": cannot, "source": row.source}


def _proxy_gold(played: Played, returns: Sequence[np.ndarray]) -> tuple[dict[str, Any], Fell]:
    """Both returns of the run's own policies, and what of the gain was lost."""
    random = [r[:, 0].mean() for p, r in zip(played.players, returns, strict=True) if p.kind == "random"]
    own = [(p.step, r) for p, r in zip(played.players, returns, strict=True) if p.step is not None]
    return over_run(
        [step for step, _ in own],
        proxy=[float(rows[:, -1].mean()) for _, rows in own],
        gold=[float(rows[:, 0].mean()) for _, rows in own],
        error=standard_errors([rows[:, 0] for _, rows in own]),
        proxy_error=standard_errors([rows[:, -1] for _, rows in own]),
        then=[float(rows[:, 1 + i].mean()) for i, (_, rows) in enumerate(own)],
        floor=float(random[0]) if random and np.isfinite(random[0]) else None,
    )


def _residual(reward: LearnedReward, base: ProbeSet, seed: int) -> dict[str, Any]:
    steps = stack(base)
    episodes = [episode for name in steps.layout.names for episode in base[name]]
    learned = np.split(read(reward, steps.batch), steps.layout.start[1:])
    try:
        found = residual(episodes, learned, gamma=reward.spec.gamma, rng=stream(seed, "residual"))
    except ValueError as failed:
        return {"reason": str(failed)}
    shown = list(found.importance.items())[:SHOWN]
    features = [{"name": name, "importance": value} for name, value in shown]
    return {"r2": found.r2, "share": found.share, "features": features}


def _survival_asked_for(base: ProbeSet) -> float:
    """|mean| / (|mean| + deviation) of the hand-written reward there; NaN where it is not known."""
    batch = stack(base).batch
    return abs(hygiene(read(HandWritten(), batch), batch.terminated.numpy()).survival_bias)


def _numbers(
    steps: Sequence[int], drift: Mapping[str, Any], base: ProbeSet, cross: Mapping[str, Any], fell: Fell
) -> tuple[dict[str, float | None], dict[str, str]]:
    """The number behind each verdict by its name, and why one is not there."""
    last, before = steps[-1], list(zip(steps, drift["to_final"], strict=True))[:-1]
    half = [d for s, d in before if s > 0 and abs(s - last / 2) <= last / 8]
    late = [d for s, d in before if s >= 0.75 * last]
    health = drift["health"][-1]
    scale = drift["hygiene"][-1]
    ends = any(episode.terminated for episodes in base.values() for episode in episodes)
    bias, truth = scale["survival_bias"], drift["to_truth"][-1]
    asked = _survival_asked_for(base)
    told = ends and not asked > BY_NAME["survival-biased"].threshold
    numbers = {
        "close": truth["value"],
        "moved": half[-1] if half else None,
        "stable": max(late) if late and None not in late else None,
        "flat": scale["std"],
        "saturated": (health["held_out"] or health["train"])["saturated"],
        "survival-biased": abs(bias) if told and bias is not None else None,
        "misleading": cross["agreement"][-1]["regret"]["value"] if "agreement" in cross else None,
    }
    reasons = {
        "close": truth.get("reason") or "the distance to the hand-written reward is not known",
        "moved": "there is no snapshot near half of the run that has a distance",
        "stable": "there is no snapshot in the last quarter of the run before its end that has a distance",
        "survival-biased": f"the hand-written reward is at {asked:.2f} itself"
        if ends
        else "no episode of the probe ends early",
        "misleading": cross.get("reason") or "how far its favourite is from the best is not known",
    }
    if isinstance(fell, str):
        return numbers, reasons | dict.fromkeys(("collapsed", "hacked"), fell)
    return numbers | dict(zip(("collapsed", "hacked"), fell, strict=True)), reasons
