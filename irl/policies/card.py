"""What is known of an exported policy: where it comes from and how well it does, episode by episode."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from irl.core import files
from irl.core.config import from_json
from irl.core.errors import UserError
from irl.core.rng import episode_seeds, stream
from irl.core.types import ActFn, Episode
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollouts


@dataclass(frozen=True)
class Measurement:
    """Undiscounted returns and lengths of a policy, one an episode; standard deviations over episodes."""

    return_mean: float
    return_std: float
    return_min: float
    return_max: float
    length_mean: float
    length_min: int
    episodes: int
    returns: tuple[float, ...]
    lengths: tuple[int, ...]
    episode_seeds: tuple[int, ...]


@dataclass(frozen=True)
class Card:
    """`card.json`: everything that a reader needs to trust or repeat a shipped policy.

    The file is flat: the fields of `measured` stand beside the others.
    """

    env_id: str
    level: str
    algorithm: str
    steps: int
    seed: int
    measured: Measurement
    random_return_mean: float
    random_return_std: float
    settings: dict[str, Any]
    versions: dict[str, str]
    command: str
    weights_sha256: str = ""
    train_s: float | None = None
    """Seconds of training by the clock, evaluations and whatever else the machine did included; None: not
    written down."""

    ADDED: ClassVar[dict[str, Any]] = {"train_s": None}


def summary(episodes: list[Episode]) -> Measurement:
    """The measurement that the episodes make."""
    returns = np.array([episode.return_ for episode in episodes])
    lengths = np.array([len(episode) for episode in episodes])
    return Measurement(
        return_mean=float(returns.mean()),
        return_std=float(returns.std()),
        return_min=float(returns.min()),
        return_max=float(returns.max()),
        length_mean=float(lengths.mean()),
        length_min=int(lengths.min()),
        episodes=len(episodes),
        returns=tuple(returns.tolist()),
        lengths=tuple(lengths.tolist()),
        episode_seeds=tuple(episode.seed or 0 for episode in episodes),
    )


def measure(
    env_id: str,
    act: ActFn,
    seeds: list[int],
    on_episode: Callable[[Episode], None] | None = None,
) -> Measurement:
    """How `act` does in fresh episodes started with `seeds`."""
    return summary(rollouts(env_id, act, seeds, on_episode))


def measure_random(env_id: str, n: int = 20) -> Measurement:
    """How uniformly random actions do: the zero of a normalised score. The same every time."""
    env = make(env_id)
    act = random_act(env.action_space, stream(0, "random policy"))
    env.close()
    return measure(env_id, act, episode_seeds(0, "random policy", n))


def normalised_score(value: float, random: float | None, expert: float | None) -> float:
    """(J - J_random) / (J_expert - J_random); NaN where a reference is missing or they are equal."""
    if random is None or expert is None or expert == random:
        return math.nan
    return (value - random) / (expert - random)


def write_card(card: Card, path: Path) -> None:
    """Write `card.json`.

    Raises:
        UserError: a return is not a finite number; a score could not be computed from the card.
    """
    if not np.isfinite([*card.measured.returns, card.random_return_mean]).all():
        raise UserError(
            f"{card.env_id} pays a reward that is not a finite number; a card needs finite returns"
        )
    content = asdict(card)
    files.write_json(path, content | content.pop("measured"))


def read_card(path: Path) -> Card:
    """The card in a file. Nothing that it names is imported: who makes its environment asks `check_module`.

    Raises:
        UserError: it is missing, damaged, or lacks a field.
    """
    content = files.read_json(path)
    measured = {field.name for field in fields(Measurement)}
    others = {field.name for field in fields(Card)} - {"measured"}
    content = Card.ADDED | content if isinstance(content, dict) else {}
    if missing := sorted((measured | others) - set(content)):
        raise UserError(f"{path} is not a policy card: it lacks {', '.join(missing)}")
    named = {name: content[name] for name in others}
    named["measured"] = {name: content[name] for name in measured}
    return from_json(Card, named, str(path))
