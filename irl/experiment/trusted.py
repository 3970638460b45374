"""What evaluation.json says of trusting a reward: by policies, over the run, what else, what at all.

`cross_play`, `proxy_gold`, `residual`, `ledger`, `chosen`, `verdicts`; each says why where it is not known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch

from irl.algorithms.probe_set import ProbeSet
from irl.core import statistics
from irl.core.rng import stream
from irl.core.types import Episode, Transitions, from_episodes
from irl.diagnostics import ledger
from irl.diagnostics.choosing import RULE, Criteria, beside, choose, disagreement
from irl.diagnostics.overoptimisation import FORM, overoptimisation, standard_errors
from irl.diagnostics.residual import residual
from irl.diagnostics.stack import read, stack
from irl.diagnostics.verdicts import NAMES, verdicts
from irl.envs.tasks import task_of
from irl.experiment.crossplay import Played, judge_cross_play, returns_of
from irl.experiment.judge import finite
from irl.rewards.learned import LearnedReward
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
        "chosen": _chosen(seen, drift, returns, cross),
        "verdicts": [asdict(v) for v in verdicts(*_numbers(steps, drift, seen.base, fell))],
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
    kind = ledger.RATIO
    if isinstance(net, ShapedNet):
        of_g = ledger.G_STATES if net.spec.sees == "obs" else ledger.G
        kind = {"g": of_g, ENTROPIC: ledger.F_LOG_PI}.get(pays, ledger.F)
    row, task = ledger.LEDGERS[kind], task_of(reward.spec.env_id)
    cannot = list(row.cannot)
    if task is not None and not task.hides.startswith("nothing"):
        cannot.append(f"what the observation hides: {task.hides}")
    return {"kind": kind, "determines": list(row.determines), "cannot": cannot, "source": row.source}


def _proxy_gold(
    played: Played, returns: Sequence[np.ndarray]
) -> tuple[dict[str, Any], tuple[float, float] | str]:
    """Both returns of the run's own policies; and what was lost while the proxy fell, and while it rose."""
    own = [(p.step, r) for p, r in zip(played.players, returns, strict=True) if p.step is not None]
    steps = np.array([step for step, _ in own])
    gold = np.array([rows[:, 0].mean() for _, rows in own])
    proxy = np.array([rows[:, -1].mean() for _, rows in own])
    now = [float(rows[:, 1 + i].mean()) for i, (_, rows) in enumerate(own)]
    error = standard_errors([rows[:, 0] for _, rows in own])
    try:
        found = overoptimisation(steps, proxy, gold, error)
    except ValueError as failed:
        return {"reason": str(failed)}, str(failed)
    columns = zip(steps.tolist(), proxy.tolist(), gold.tolist(), error.tolist(), now, strict=True)
    names = ("step", "proxy", "gold", "gold_error", "proxy_then")
    content = {
        "points": [dict(zip(names, row, strict=True)) for row in columns],
        "peak_step": int(steps[found.peak]),
        "drop": finite(found.drop),
        "gap": finite(found.gap),
        "proxy_rose": found.proxy_rose,
        "decoupling_step": None if found.decoupling is None else int(steps[found.decoupling]),
        "fit": None if found.fit is None else {**asdict(found.fit), "peak": found.fit.peak, "form": FORM},
        "fit_reason": found.fit_reason,
    }
    if not np.isfinite(found.drop):
        return content, "the true return never rose beyond its errors"
    return content, (0.0, found.drop) if found.proxy_rose else (found.drop, 0.0)


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


def _chosen(
    seen: Seen, drift: Mapping[str, Any], returns: Sequence[np.ndarray], cross: Mapping[str, Any]
) -> dict[str, Any]:
    """Which snapshot would be kept without the truth, and where it is known how good a choice that is."""
    steps = list(seen.rewards)
    learned = np.stack([rows[:, 1:].mean(0) for rows in returns], axis=1)
    loss = _losses(seen)
    speed = np.array([np.nan if v is None else v for v in drift["speed"]])
    columns = zip(loss, beside(speed), disagreement(learned), strict=True)
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


def _losses(seen: Seen) -> list[float]:
    """Of each snapshot the share of pairs in which a policy's step outranks the expert's."""
    if seen.held_out is None:
        return [np.nan] * len(seen.rewards)
    policies = from_episodes([episode for episodes in seen.fresh.values() for episode in episodes])
    found = []
    for reward in seen.rewards.values():
        with torch.no_grad():
            expert, policy = (reward.logits(b).double().numpy() for b in (seen.held_out, policies))
        found.append(1.0 - statistics.auroc(expert, policy))
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


def _numbers(
    steps: Sequence[int], drift: Mapping[str, Any], base: ProbeSet, fell: tuple[float, float] | str
) -> tuple[dict[str, float | None], dict[str, str]]:
    """The number behind each verdict by its name, and why one is not there."""
    last, before = steps[-1], list(zip(steps, drift["to_final"], strict=True))[:-1]
    half = [d for s, d in before if s > 0 and abs(s - last / 2) <= last / 8]
    late = [d for s, d in before if s >= 0.75 * last]
    health = drift["health"][-1]
    hygiene = drift["hygiene"][-1]
    ends = any(episode.terminated for episodes in base.values() for episode in episodes)
    bias = hygiene["survival_bias"]
    numbers = {
        "moved": half[-1] if half else None,
        "stable": max(late) if late and None not in late else None,
        "flat": hygiene["std"],
        "saturated": (health["held_out"] or health["train"])["saturated"],
        "survival-biased": abs(bias) if ends and bias is not None else None,
    }
    reasons = {
        "moved": "there is no snapshot near half of the run that has a distance",
        "stable": "there is no snapshot in the last quarter of the run before its end that has a distance",
        "survival-biased": "no episode of the probe ends early",
    }
    if isinstance(fell, str):
        return numbers, reasons | dict.fromkeys(("collapsed", "hacked"), fell)
    return numbers | dict(zip(("collapsed", "hacked"), fell, strict=True)), reasons
