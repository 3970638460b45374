"""`irl evaluate RUN --gate FILE.toml`: what an evaluation has to come to, for a script to go by.

    [bounds]
    score = { min = 0.9 }                  # a name of BOUNDS
    distance = { max = 0.25 }

    [verdicts]
    hacked = false                         # a name of irl.diagnostics.verdicts.NAMES, and whether it may fire

A number that is not known keeps no bound: what was to be held was not measured.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from irl.core import files
from irl.core.errors import UserError
from irl.diagnostics.verdicts import NAMES
from irl.report.folder import lookup, number

BOUNDS: dict[str, str] = {
    "return": "policy.return_mean",
    "return-min": "policy.return_min",
    "score": "policy.normalised_score",
    "distance": "distances.headline.value",
    "distance-high": "distances.headline.high",
    "explained": "terms.explained",
    "survival-bonus": "terms.survival_bonus",
    "drop": "proxy_gold.drop",
    "gap": "proxy_gold.gap",
    "pearson": "last_agreement.pearson.value",
    "spearman": "last_agreement.spearman.value",
    "kendall": "last_agreement.kendall.value",
    "kendall-low": "last_agreement.kendall.low",
    "regret": "last_agreement.regret.value",
    "cycling": "drift.cycling",
}
"""What can be bounded, and where it stands; `last_agreement` is cross_play's of the last snapshot."""


@dataclass(frozen=True)
class Gate:
    """A file of bounds."""

    bounds: Mapping[str, tuple[float, float]]
    """Least and most of a name of `BOUNDS`."""
    verdicts: Mapping[str, bool]
    """Whether a verdict has to have fired."""


def read_gate(path: Path) -> Gate:
    """The gate in a file.

    Raises:
        UserError: there is none, it is no TOML, or it names what there is not.
    """
    content = files.read_toml(path, "gate")
    _known(path, content, ("bounds", "verdicts"), "part")
    bounds, fired = (_table(path, content, name) for name in ("bounds", "verdicts"))
    if not bounds and not fired:
        raise UserError(
            f"{path} states no bound; expected [bounds] or [verdicts], e.g. score = {{ min = 0.9 }}"
        )
    _known(path, bounds, BOUNDS, "bound")
    _known(path, fired, NAMES, "verdict")
    if wrong := [name for name, value in fired.items() if not isinstance(value, bool)]:
        raise UserError(f"{path}: verdicts.{wrong[0]} has to be true or false, not {fired[wrong[0]]!r:.40}")
    return Gate({name: _bound(path, name, value) for name, value in bounds.items()}, fired)


def broken(gate: Gate, evaluation: Mapping[str, Any]) -> list[str]:
    """A line for each bound that the evaluation breaks."""
    agreement = lookup(evaluation, "cross_play.agreement") or [{}]
    document = {**evaluation, "last_agreement": agreement[-1]}
    lines = []
    for name, (least, most) in gate.bounds.items():
        value = number(document, BOUNDS[name])
        if value is None:
            lines.append(f"{name} is not known, and was to be {_words(least, most)}")
        elif not least <= value <= most:
            lines.append(f"{name} is {value:.4g}, and was to be {_words(least, most)}")
    judged = {row["name"]: row for row in evaluation.get("verdicts", [])}
    for name, wanted in gate.verdicts.items():
        row = judged.get(name, {"fired": None, "reason": "it was not judged"})
        if row["fired"] is None:
            lines.append(f"{name} was not judged: {row['reason']}")
        elif row["fired"] != wanted:
            is_now = "fired" if row["fired"] else "did not fire"
            lines.append(f"{name} {is_now}: {row['value']:.4g} against {row['threshold']:g}")
    return lines


def _bound(path: Path, name: str, value: object) -> tuple[float, float]:
    sides = value if isinstance(value, dict) else {}
    numbers = [v for v in sides.values() if isinstance(v, int | float) and not isinstance(v, bool)]
    if sides and set(sides) <= {"min", "max"} and len(numbers) == len(sides):
        least, most = float(sides.get("min", -math.inf)), float(sides.get("max", math.inf))
        # false where one is nan
        if least <= most:
            return least, most
    raise UserError(f"{path}: bounds.{name} is {value!r:.60}; expected e.g. {{ min = 0.5, max = 1 }}")


def _table(path: Path, content: Mapping[str, Any], name: str) -> dict[str, Any]:
    if not isinstance(table := content.get(name, {}), dict):
        raise UserError(f"{path}: {name} is {table!r:.40}; expected a table, [{name}]")
    return table


def _known(path: Path, named: Mapping[str, Any], there: Any, what: str) -> None:
    if unknown := [name for name in named if name not in there]:
        raise UserError(f"{path}: there is no {what} {unknown[0]!r:.40}; there are {', '.join(there)}")


def _words(least: float, most: float) -> str:
    if math.isinf(most):
        return f"{least:g} or more"
    return f"{most:g} or less" if math.isinf(least) else f"{least:g} to {most:g}"
