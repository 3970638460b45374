"""Whether the page can be trusted: self-tests, coverage, versions, hashes, formula, citation."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

from irl.report.citations import citations, formula
from irl.report.folder import RunFiles, finite, last_snapshot, lookup, number, texts
from irl.report.header import CHIEF_PACKAGES
from irl.report.panel import Cell, Panel, Table


def trust(run: RunFiles) -> Panel:
    """Tables; those that are not known are left out and said."""
    found = {
        "self-tests": _self_tests(run),
        "coverage": _coverage(run),
        "the reward used": _reward(run),
        "what it can and cannot say": _ledger(run),
        "versions": _versions(run),
        "citations": _cited(run),
    }
    missing = [name for name, table in found.items() if table is None]
    notes = (f"Not shown: {', '.join(missing)}. To have them: irl evaluate {run.name}",) if missing else ()
    text = (
        "Before a number above is believed: the own error should be near 0 and the negation near 1; a large "
        "share outside the probe means that the page is silent about what the policy does most. Covered is a "
        "kind of play with episodes enough for an interval; policy at 50 % is this run's own policy of the "
        "snapshot halfway through."
    )
    return Panel("trust", "Trust", text, "trust", tables=tuple(t for t in found.values() if t), notes=notes)


def _self_tests(run: RunFiles) -> Table | None:
    curve = lookup(run.evaluation, "distances.curve")
    rows = [row for row in curve if isinstance(row, Mapping)] if isinstance(curve, list) else []
    if not rows:
        return None
    keys = ("self_error", "negation", "random", "episodes")
    shown = [(_segments(row.get("n")), *(finite(row.get(key)) for key in keys)) for row in rows]
    head = ("segments", "own error (want 0)", "negation (want 1)", "random reward", "episodes")
    return Table(head, shown, "Self-tests of the distance")


def _segments(n: object) -> str:
    return "whole episodes" if n == 0 else "1 step" if n == 1 else f"{n} steps"


def _coverage(run: RunFiles) -> Table | None:
    strata = lookup(run.evaluation, "distances.strata")
    if not isinstance(strata, Mapping) or not strata:
        return None
    rows: list[tuple[Cell, ...]] = [
        (
            str(name),
            number(row, "steps"),
            number(row, "episodes"),
            "not distinguishable" if lookup(row, "distinguishable") is False else number(row, "value"),
            number(row, "self_error"),
            "yes" if lookup(row, "covered") is True else "no: too few episodes",
        )
        for name, row in strata.items()
    ]
    outside = lookup(run.evaluation, "drift.outside")
    last = finite(outside[-1]) if isinstance(outside, list) and outside else None
    said = (
        "" if last is None else f"; {100 * last:.0f} % of the final policy's steps lie outside the base probe"
    )
    head = ("kind of play", "steps", "episodes", "distance within", "own error", "covered")
    return Table(head, rows, f"Coverage of the probe{said}")


def _reward(run: RunFiles) -> Table | None:
    rows: list[tuple[Cell, ...]] = []
    if run.reward:
        rows = [("formula", formula(run.reward))]
        rows += [
            (key, str(run.reward[key]))
            for key in ("method", "reward_map", "gamma", "env_id")
            if key in run.reward
        ]
    if (last := last_snapshot(run.path)) is not None:
        rows += [
            (f"{name}, SHA-256", _sha256(last / name))
            for name in ("reward/weights.safetensors", "policy.safetensors")
        ]
        rows.append(("snapshot", last.name))
    probe = lookup(run.evaluation, "distances.probe_sha256")
    rows += [("base probe, SHA-256", probe)] if isinstance(probe, str) else []
    return Table(("", ""), rows, "The reward used") if rows else None


def _sha256(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "not there"
    except OSError as error:
        return str(error.strerror)


def _ledger(run: RunFiles) -> Table | None:
    rows: list[tuple[Cell, ...]] = [
        ("it determines", line) for line in texts(lookup(run.evaluation, "ledger.determines"))
    ]
    rows += [("it cannot say", line) for line in texts(lookup(run.evaluation, "ledger.cannot"))]
    source = lookup(run.evaluation, "ledger.source")
    rows += [("source", source)] if isinstance(source, str) else []
    return Table(("a reward of this kind", ""), rows, "What it can and cannot say") if rows else None


def _versions(run: RunFiles) -> Table | None:
    packages, python = run.environment.get("packages"), run.environment.get("python")
    known = packages if isinstance(packages, Mapping) else {}
    rows: list[tuple[Cell, ...]] = [("Python", str(python))] if python else []
    rows += [(name, str(known[name])) for name in CHIEF_PACKAGES if name in known]
    commit = run.environment.get("git_commit")
    dirty = " with uncommitted changes" if run.environment.get("git_dirty") else ""
    rows += [("commit", f"{commit}{dirty}")] if commit else []
    return Table(("", "version"), rows, "Versions at training") if rows else None


def _cited(run: RunFiles) -> Table | None:
    kind = run.evaluation.get("method") or run.config.get("kind") or ""
    rows = citations(str(kind))
    return Table(("for", "cite"), rows, "Citations") if rows else None
