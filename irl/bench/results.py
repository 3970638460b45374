"""The published result of a cell: one JSON, read back by the tables."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from irl.bench.cells import Cell
from irl.core import files
from irl.core.config import to_json
from irl.core.errors import UserError
from irl.core.provenance import environment
from irl.core.records import RunFolder, open_run
from irl.policies.card import normalised_score

PLACES = ("out", "datasets_root", "run", "watch", "kind", "seed", "seeds", "env_id", "env_kwargs", "demos")
"""Settings of a run that say where, or that the cell says already."""


def of_training(cell: Cell, run: Path) -> dict[str, Any]:
    """What is published of a run of `irl train` that `irl evaluate` has judged."""
    found = files.read_json(run / "evaluation.json")
    policy, references = found["policy"], found["references"]
    return {
        **_begun(cell, f"irl train {cell.method} {' '.join(cell.words)}"),
        "env_steps": found["env_steps"],
        "score": policy["normalised_score"],
        **{name: policy[name] for name in ("return_mean", "return_std", "return_min")},
        **{
            f"{name}_return": (references.get(name) or {}).get("return_mean") for name in ("random", "expert")
        },
        "reward": _reward(found),
        **_of_run(run),
    }


def of_retraining(cell: Cell, run: Path, source: Path, snapshot: int) -> dict[str, Any]:
    """What is published of a run of `irl retrain`, with what is known of the reward itself."""
    found, beside = files.read_json(run / "retrain.json"), files.read_json(source / "evaluation.json")
    true = found["true"]
    return {
        **_begun(cell, f"irl retrain {cell.source} --snapshot {snapshot} {' '.join(cell.words)}"),
        "env_steps": found["env_steps"],
        "score": true["normalised_score"],
        **{name: true[name] for name in ("return_mean", "return_std", "return_min")},
        **{f"{name}_return": true[f"{name}_return_mean"] for name in ("random", "expert")},
        "learned_return_mean": found["learned"]["return_mean"],
        "snapshot": snapshot,
        "score_of_the_run": beside["policy"]["normalised_score"],
        "reward": _reward(beside, snapshot),
        **_of_run(run),
    }


def of_peer(cell: Cell, run: Path) -> dict[str, Any]:
    """What is published of a peer's run: what its script wrote, and where it was made."""
    found = files.read_json(run / "peer.json")
    where = environment("")
    said = " ".join((cell.script, cell.method, cell.task, "DEMONSTRATIONS", str(cell.seed), str(cell.steps)))
    return {
        **_begun(cell, f"PEER_PYTHON {said} RUN"),
        **{name: found[name] for name in ("env_steps", "return_mean", "return_std", "return_min")},
        "settings": found["settings"],
        "versions": found["versions"],
        **_curve(RunFolder(run).metrics()),
        **{name: where[name] for name in ("machine", "device")},
        "threads": 1,
        "commit": where["git_commit"],
        "dirty": where["git_dirty"],
    }


def scored(result: dict[str, Any], references: tuple[float, float] | None) -> dict[str, Any]:
    """The result with its normalised score, where it has none and the returns of the ends are known."""
    if result.get("score") is not None or references is None:
        return result
    random, expert = references
    score = normalised_score(result["return_mean"], random, expert)
    return {**result, "score": score, "random_return": random, "expert_return": expert}


def _begun(cell: Cell, command: str) -> dict[str, Any]:
    return {
        "format": "irl.bench.cell",
        "version": 1,
        "grid": cell.grid,
        "method": cell.arm,
        "task": cell.task,
        "seed": cell.seed,
        "demos": cell.episodes,
        "demo_rate": cell.rate,
        "command": command,
        "cell": to_json(cell),
    }


def _of_run(run: Path) -> dict[str, Any]:
    folder = open_run(run)
    made = files.read_json(run / "environment.json")
    return {
        **_curve(folder.metrics()),
        "settings": {name: value for name, value in folder.config.items() if name not in PLACES},
        "versions": made["packages"],
        **{name: made[name] for name in ("machine", "device", "threads")},
        "commit": made["git_commit"],
        "dirty": made["git_dirty"],
        # another commit or machine, from a step on
        **({"resumed": made["resumed"]} if "resumed" in made else {}),
    }


def _curve(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    at = [row for row in rows if row.get("eval_return_mean") is not None]
    return {
        "curve": [[row["env_steps"], row["eval_return_mean"]] for row in at],
        "curve_s": [round(row["wall_s"], 1) for row in at],
        "wall_s": round(rows[-1]["wall_s"], 1),
    }


def _reward(found: Mapping[str, Any], snapshot: int | None = None) -> dict[str, Any] | None:
    """Of a reward, how far it is from the hand-written one and what it pays for; None of `bc`, and unjudged.

    The weights are those of the last snapshot, the only one they are calculated for.
    """
    if "headline" not in found.get("distances", {}):
        return None
    agreement = {name: found["reward"][name] for name in ("pearson", "spearman", "auroc")}
    distance, terms = found["distances"]["headline"], found["terms"]
    if snapshot is not None:
        distance = found["drift"]["to_truth"][found["drift"]["snapshots"].index(snapshot)]
    weights = {
        name: {key: row[key] for key in ("weight", "low", "high", "standardised")}
        for name, row in (terms.get("weights") or {}).items()
    }
    return {
        **agreement,
        "distance": {name: distance[name] for name in ("name", "n", "value", "low", "high", "reason")},
        "weights": weights,
        "explained": terms.get("explained"),
    }


def read_results(folder: Path, cells: Sequence[Cell] = ()) -> list[dict[str, Any]]:
    """Every result in a folder, in the order of these cells and of its files' names.

    Raises:
        UserError: there is none, or one is damaged.
    """
    found = [_read(path) for path in sorted(folder.glob("*.json"))]
    if not found:
        raise UserError(f"{folder} has no result yet; make them with: irl bench {folder.name}")
    order = {cell.name: i for i, cell in enumerate(cells)}
    return sorted(found, key=lambda result: order.get(Path(result["file"]).stem, len(order)))


NEEDED = ("method", "task", "seed", "score", "curve", "wall_s")


def _read(path: Path) -> dict[str, Any]:
    content = files.read_json(path)
    if missing := [name for name in NEEDED if name not in (content if isinstance(content, dict) else {})]:
        raise UserError(f"{path} is no result of a cell: it lacks {', '.join(missing)}")
    # what was written before there were grids has other names for some
    older = {"commit": content.get("git_commit"), "versions": content.get("packages"), "demo_rate": 1}
    return {**older, "file": path.name, **content}
