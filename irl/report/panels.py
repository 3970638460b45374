"""The figures of a run with their titles and how to read them, or the reason why one is not there."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import plotly.graph_objects as go

from irl.report import plots
from irl.report.folder import RunFiles, column, lookup, number, why_missing
from irl.report.palette import CHANGES, STRATA


@dataclass(frozen=True)
class Panel:
    """One figure of the page: without a figure, `text` is the reason instead of the reading."""

    anchor: str
    title: str
    text: str
    figure: go.Figure | None = None


def panels(run: RunFiles) -> list[Panel]:
    """All panels, in the order of the page."""
    makers: tuple[Callable[[RunFiles], Panel], ...] = (learning, strata, agreement, moves, discriminator)
    return [maker(run) for maker in makers]


def learning(run: RunFiles) -> Panel:
    """How the return grew."""
    anchor, title = "learning", "Learning curve"
    measured = column(run.metrics, "env_steps", "return_mean")[0]
    evaluated = column(run.metrics, "env_steps", "eval_return_mean")[0]
    if not measured and not evaluated:
        return Panel(anchor, title, _no_metrics(run, "no episode has finished yet, so there is no return"))
    known = {who: number(run.evaluation, f"references.{who}.return_mean") for who in _REFERENCES}
    references = {who: value for who, value in known.items() if value is not None}
    text = (
        "The return that the task pays and the learner never sees: the thin line is the exploring policy"
        + ("; the markers are the deterministic policy on starts of its own" if evaluated else "")
        + ("; it should climb to the expert's line." if "expert" in references else ".")
    )
    return Panel(anchor, title, text, plots.learning_curve(run.metrics, references))


def strata(run: RunFiles) -> Panel:
    """What the reward gave to expert, policy and random play as it was learned."""
    anchor, title = "strata", "Reward by kind of play, over training"
    snapshots, bands = _listed(run, "drift.snapshots"), lookup(run.evaluation, "drift.strata")
    known = {name: bands[name] for name in STRATA if isinstance(bands, Mapping) and _filled(bands.get(name))}
    if not snapshots or not known:
        return Panel(anchor, title, _sentence(why_missing(run.evaluation, "drift.strata")))
    text = (
        "Each snapshot of the reward, on the same probe steps (line: median; band: 10 to 90 % of them): "
        "a useful reward puts the expert on top and random play at the bottom."
    )
    return Panel(anchor, title, text, plots.reward_by_stratum(snapshots, known))


def agreement(run: RunFiles) -> Panel:
    """The learned reward against the hand-written one."""
    anchor, title = "agreement", "Learned against hand-written reward, per step"
    names = ("learned", "hand_written", "stratum")
    learned, hand_written, stratum = (_listed(run, f"reward.scatter.{name}") for name in names)
    if not (learned and hand_written and len(learned) == len(hand_written) == len(stratum)):
        missing = "reward.scatter.hand_written" if learned else "reward.scatter"
        reason = why_missing(run.evaluation, missing if lookup(run.evaluation, "reward") else "reward")
        pearson = why_missing(run.evaluation, "reward.pearson")
        return Panel(
            anchor, title, _sentence(pearson if number(run.evaluation, "reward.pearson") is None else reason)
        )
    values = {name: number(run.evaluation, f"reward.{name.lower()}") for name in ("Pearson", "Spearman")}
    title += ": " + ", ".join(
        f"{k} {v:.2f}" if v is not None else f"{k} undefined" for k, v in values.items()
    )
    text = (
        "A rising cloud means that the learned reward ranks steps as the hand-written one does; "
        "a reward that differs by shaping alone can scatter here and still want the same policy."
    )
    if values["Pearson"] is None:
        text += " " + _sentence(f"undefined because {why_missing(run.evaluation, 'reward.pearson')}")
    return Panel(anchor, title, text, plots.learned_against_hand_written(learned, hand_written, stratum))


def moves(run: RunFiles) -> Panel:
    """What changed in the reward from snapshot to snapshot."""
    anchor, title = "moves", "What moved between snapshots"
    changes = [row for row in _listed(run, "drift.changes") if isinstance(row, Mapping)]
    if not any(all(number(row, key) is not None for key in ("to", "total", *CHANGES)) for row in changes):
        return Panel(anchor, title, _sentence(why_missing(run.evaluation, "drift.changes")))
    text = (
        "Above: how far the reward moved since the snapshot before; below: how much of that was an offset "
        "(every step alike), a scale (larger differences) or shape (other steps preferred), of which only "
        "shape asks for another behaviour, unless episodes can end early."
    )
    return Panel(anchor, title, text, plots.what_moved(changes))


def discriminator(run: RunFiles) -> Panel:
    """Whether expert and policy can be told apart."""
    anchor, title = "discriminator", "Discriminator health"
    snapshots, auroc = _listed(run, "drift.snapshots"), _listed(run, "drift.auroc")
    keys = [f"discriminator/accuracy_{name}" for name in ("expert", "policy")]
    if not any(column(run.metrics, "env_steps", key)[0] for key in keys):
        return Panel(anchor, title, _no_metrics(run, "metrics.jsonl has no discriminator accuracy"))
    text = (
        "Near 100 % the discriminator sees through the policy and its reward is steep; at 50 % (dashed) it "
        "cannot tell the policy from the expert, so the reward has nothing left to say."
    )
    return Panel(anchor, title, text, plots.discriminator_health(run.metrics, snapshots, auroc))


_REFERENCES = ("expert", "demonstrations", "random")


def _listed(run: RunFiles, path: str) -> Sequence[Any]:
    found = lookup(run.evaluation, path)
    return found if isinstance(found, list) else []


def _filled(bands: object) -> bool:
    return isinstance(bands, Mapping) and all(
        isinstance(bands.get(key), list) for key in ("p10", "median", "p90")
    )


def _no_metrics(run: RunFiles, otherwise: str) -> str:
    return _sentence(run.problems.get("metrics.jsonl", otherwise) if not run.metrics else otherwise)


def _sentence(reason: str) -> str:
    return f"Not shown: {reason.rstrip('.')}."
