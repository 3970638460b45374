"""What fresh policies make of the frozen reward, where it was learned and elsewhere."""

from collections.abc import Mapping
from typing import Any

from irl.report.folder import RunFiles, finite, lookup, number
from irl.report.panel import Cell, Panel, Table, absent


def transfer(run: RunFiles) -> Panel:
    """A row a snapshot, part and dynamics; or the card of one retrained run."""
    anchor, title = "retrain", "Retrain and transfer"
    found = run.retrained.get("rows")
    rows = [row for row in found if isinstance(row, Mapping)] if isinstance(found, list) else []
    tables = ([_table(rows)] if rows else []) + ([_card(run.retrain)] if run.retrain else [])
    if not tables:
        reason = "no policy was retrained on this reward, which is the strongest test of it"
        return absent(anchor, title, reason, f"irl retrain {run.name}")
    text = (
        "The strongest test: a policy that has seen neither demonstrations nor discriminator, on the reward "
        "as it stands. A score near 1 means that the reward alone teaches the task; one near 0 that it only "
        "worked beside the policy it was learned with."
    )
    return Panel(anchor, title, text, "retrain", tables=tuple(tables))


def _table(rows: list[Mapping[str, Any]]) -> Table:
    head = (
        "frozen reward",
        "dynamics",
        "seeds",
        "scores of the seeds",
        "mean score",
        "ratio",
        "95 % low",
        "high",
    )
    return Table(head, [_row(row) for row in rows], "Fresh policies on the frozen reward")


def _row(row: Mapping[str, Any]) -> tuple[Cell, ...]:
    scores = [finite(value) for value in _list(row.get("scores"))]
    known = [value for value in scores if value is not None]
    seeds = row.get("seeds")
    part = f", {row['part']}" if row.get("part") else ""
    part += f"; {row['changed']}" if row.get("changed") else ""
    dynamics = row.get("dynamics")
    return (
        f"step {row.get('snapshot')}{part}",
        "as learned" if not dynamics else str(dynamics),
        float(len(seeds)) if isinstance(seeds, list) else finite(seeds),
        ", ".join("?" if value is None else f"{value:.3f}" for value in scores),
        sum(known) / len(known) if known else None,
        *(finite(lookup(row, f"ratio.{key}")) for key in ("value", "low", "high")),
    )


def _card(card: Mapping[str, Any]) -> Table:
    names = {
        "of the run": lookup(card, "reward.run"),
        "snapshot, step": number(card, "reward.env_steps"),
        "paid": lookup(card, "reward.reward_map"),
        "learner": card.get("algorithm"),
        "task": card.get("env_id"),
        "environment steps": number(card, "env_steps"),
        "true return": number(card, "true.return_mean"),
        "± std": number(card, "true.return_std"),
        "worst": number(card, "true.return_min"),
        "normalised score": number(card, "true.normalised_score"),
        "learned return": number(card, "learned.return_mean"),
    }
    rows = [
        (key, value if isinstance(value, float) or value is None else str(value))
        for key, value in names.items()
    ]
    return Table(("this run is a policy on a frozen reward", ""), rows, "The retrained policy")


def _list(values: object) -> list[Any]:
    return values if isinstance(values, list) else []
