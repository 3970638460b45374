"""`irl metrics`: what each number of a run means, from where it is declared."""

from dataclasses import dataclass

from rich import box
from rich.console import Console
from rich.table import Table

from irl.core.metrics import DECLARED


@dataclass(frozen=True)
class Glossary:
    """Say what each name in a run's metrics.jsonl means, and its unit."""

    markdown: bool = False
    """As a page of Markdown, which is how scripts/benchmarks/METRICS.md is made."""


def glossary(command: Glossary) -> None:
    """Print it."""
    if command.markdown:
        print(markdown(), end="")
        return
    table = Table(box=box.SIMPLE_HEAD)
    for column in ("name", "unit", "meaning"):
        table.add_column(column, no_wrap=column == "name")
    for name, (meaning, unit) in sorted(DECLARED.items()):
        table.add_row(name, unit, meaning)
    Console().print(table)


def markdown() -> str:
    """The page: a row a name, in alphabetical order."""
    rows = [f"| `{name}` | {unit} | {meaning} |" for name, (meaning, unit) in sorted(DECLARED.items())]
    head = [
        "# Metrics",
        "",
        "Every number that a run writes into `metrics.jsonl`, from `irl/core/metrics.py`; made by",
        "`irl metrics --markdown`.",
        "",
        "| name | unit | meaning |",
        "|---|---|---|",
    ]
    return "\n".join([*head, *rows]) + "\n"
