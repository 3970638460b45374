"""`irl experts evaluate` and `list`: what is on the shelf, as a table."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from irl.core.config import check_at_least, check_seed
from irl.core.errors import UserError
from irl.core.rng import episode_seeds
from irl.demos.players import Play, play_here, players
from irl.demos.recording import Recording
from irl.experiment.progress import each_episode, progress
from irl.policies import shelf
from irl.policies.card import Card, Measurement, summary
from irl.policies.policy import Policy

EPISODES = 20
"""Episodes that a card is measured on."""
WIDE = 200
"""Columns of a table that is for a file and not for a terminal."""


@dataclass(frozen=True)
class EvaluateExpert:
    """Measure policies of the shelf again, in the episodes of their cards or in fresh ones."""

    env_id: str | None = None
    """Only this task."""
    all: bool = False
    """Every task and level, a process a core."""
    level: str | None = None
    """Only this level; expert, or with --all every one, unless given."""
    episodes: int = EPISODES
    """How many episodes."""
    seed: int = 0
    """Draws the episodes; 20 of seed 0 are those of the card."""
    policies_root: Path | None = None
    """Where the shelf is; expert_data/policies unless given."""
    workers: int | None = None
    """Processes that play; 1, or with --all one a core, unless given."""
    markdown: bool = False
    """Print the table as Markdown, which is how README's is made."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "episodes")
        if self.workers is not None:
            check_at_least(self, 1, "workers")
        check_seed(self.seed)
        if self.all and self.env_id:
            raise ValueError("--all measures every task; leave it or --env-id away")


@dataclass(frozen=True)
class ListExperts:
    """Show the shelf."""

    policies_root: Path | None = None
    """Where the shelf is; expert_data/policies unless given."""
    markdown: bool = False
    """Print the table as Markdown."""


@dataclass(frozen=True)
class Row:
    """A policy of the table."""

    card: Card
    measured: Measurement
    folder: Path


def evaluate(command: EvaluateExpert) -> None:
    """Measure again what the shelf holds and print it."""
    root, level = command.policies_root, command.level or (None if command.all else "expert")
    if command.env_id:
        named = [(command.env_id, level or "expert")]
    else:
        named = [(card.env_id, card.level) for card in shelf.to_play(level, root)]
    rows = []
    with players(command.workers or (cores() if command.all else 1)) as play:
        for env_id, of_level in named or [("Hopper-v5", level or "expert")]:
            found = shelf.find(env_id, of_level, root)
            measured = measured_of(env_id, found.policy, command.episodes, command.seed, play)
            rows.append(Row(found.card, measured, found.path))
    _print(rows, command.markdown)


def list_experts(command: ListExperts) -> None:
    """Print the cards of the shelf."""
    rows = [Row(card, card.measured, folder) for card, folder in shelf.folders(command.policies_root)]
    if not rows:
        roots = ", ".join(str(root) for root in shelf.roots(command.policies_root))
        raise UserError(f"no policies in {roots}; train one with: irl experts train --env-id Hopper-v5")
    _print(rows, command.markdown)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def measured_of(env_id: str, policy: Policy, n: int, seed: int, play: Play = play_here) -> Measurement:
    """How the policy does in `n` episodes drawn with `seed`; shows how far it is."""
    episodes = []
    with progress(f"measuring {env_id}", n) as report:
        tell = each_episode(report)
        for episode, _ in play(env_id, policy, Recording(), episode_seeds(seed, "card", n)):
            episodes.append(episode)
            tell(episode)
    return summary(episodes)


def shelf_table(rows: Sequence[Row], markdown: bool = False) -> Table:
    """The policies for a person to read."""
    n = rows[0].measured.episodes if rows else 0
    title = f"deterministic policies over {n} episodes; return mean ± std, mean length (shortest)"
    frame = box.MARKDOWN if markdown else box.SIMPLE_HEAD
    table = Table(title=None if markdown else title, title_justify="left", box=frame)
    columns = ("task", "level", "made by", "steps", "trained", "return", "min", "length", "random", "size")
    for column in columns:
        table.add_column(column, no_wrap=column in ("task", "level"))
    for row in rows:
        card, m = row.card, row.measured
        table.add_row(
            # escaped: what a card says is not markup
            *(escape(words) for words in (card.env_id, card.level, card.algorithm)),
            f"{card.steps / 1e6:.3g}M",
            "-" if card.train_s is None else f"{card.train_s / 60:.0f} min",
            f"{m.return_mean:.1f} ± {m.return_std:.1f}",
            f"{m.return_min:.1f}",
            f"{m.length_mean:.0f} ({m.length_min})",
            f"{card.random_return_mean:.1f}",
            f"{(row.folder / shelf.POLICY).stat().st_size / 1e3:.0f} kB",
        )
    return table


def _print(rows: Sequence[Row], markdown: bool) -> None:
    console = Console(width=WIDE) if markdown else Console()
    console.print(shelf_table(rows, markdown))
