"""The form of the tables: what is damaged, what is typed, and what must then be said."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.malformed.damage import Damage

DATA = "datasets/irl/pointmass/expert-v0/data"
SHELVED = "policies/pointmass/expert"
SNAPSHOT = "run/snapshots/000000768"


@dataclass(frozen=True)
class Case:
    """One malformed input."""

    words: str
    """The command."""
    named: tuple[str, ...]
    """What its one line must contain."""
    damage: Callable[[Path], None] = lambda world: None
    """What is done to the world before."""
    fault: str = ""
    """What is wrong with the environment, a key of `environments.FAULTY`."""


def at(place: str, damage: Damage) -> Damage:
    """The damage at a place in the world."""
    return lambda world: damage(world / place)
