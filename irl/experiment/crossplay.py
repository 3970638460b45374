"""The `cross_play` of evaluation.json: every snapshot's reward on every policy, against true returns.

A run's own policies lie on one road, and nearly every reward ranks those alike: beside them play the base
probe's expert, middling, noisy and random strata, and what is after something else in the same body.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import episode_seeds, stream
from irl.core.types import ActFn, Episode, from_episodes
from irl.diagnostics.crossplay import Agreement, CrossPlay, cross_play
from irl.diagnostics.stack import Given, read
from irl.envs.discrete import OneHot
from irl.envs.make import make
from irl.envs.names import split_name
from irl.envs.rollouts import rollouts
from irl.experiment.judge import finite
from irl.experiment.progress import progress
from irl.policies import shelf
from irl.policies.policy import Policy

EPISODES = 5
"""Episodes of each policy that is played for this alone."""
KINDS = {"expert": "expert", "medium": "medium", "noisy expert": "noisy-expert", "random": "random"}
"""Strata of the base probe by the kind of policy they are."""
STILL = "holding still"


@dataclass(frozen=True, eq=False)
class Player:
    """One policy of the set, played."""

    name: str
    kind: str
    episodes: Sequence[Episode]
    step: int | None = None
    """Of a checkpoint."""


@dataclass(frozen=True, eq=False)
class Played:
    """The policy set of a run."""

    players: tuple[Player, ...]
    notes: tuple[str, ...] = ()
    cost: Mapping[str, int] = field(default_factory=dict)
    """Steps that were played for this alone."""


def play_policies(
    env_id: str, policies: Mapping[int, Policy], base: ProbeSet, seed: int, root: Path | None
) -> Played:
    """The deterministic policies of a run and of second tasks, played now; the base probe's as they are.

    Every policy starts from the same resets. A second task is another reward in the same body: a shelved
    policy of the same environment given other arguments, and holding still.
    """
    acts: list[tuple[str, str, ActFn, int | None]] = [
        (f"checkpoint at {at:,}", "checkpoint", policy, at) for at, policy in policies.items()
    ]
    others, notes = _second_tasks(env_id, root)
    acts += [(name, "second-task", act, None) for name, act in others]
    seeds, players = episode_seeds(seed, "cross-play", EPISODES), []
    with progress("cross-play", len(acts)) as report:
        for i, (name, kind, act, step) in enumerate(acts, 1):
            players.append(Player(name, kind, rollouts(env_id, act, seeds), step))
            report(i, name)
    steps = sum(len(episode) for player in players for episode in player.episodes)
    players += [Player(name, KINDS[name], base[name]) for name in base if name in KINDS]
    notes += [f"{name}: {base.about[name]}." for name in base if name == "medium" and name in base.about]
    return Played(tuple(players), tuple(notes), {"steps": steps})


def judge_cross_play(
    returns: Sequence[np.ndarray], snapshots: Sequence[int], played: Played, seed: int
) -> dict[str, Any]:
    """The matrix of returns and its agreement with the true ones, or the reason why there is none.

    Args:
        returns: of each player those of `returns_of`, a reward a snapshot.
    """
    try:
        found = cross_play(returns, stream(seed, "cross-play"))
    except ValueError as error:
        return {"reason": str(error)}
    if np.ptp(found.true) == 0:
        return {"reason": f"the true return of each of these {len(found.true)} policies is {found.true[0]:g}"}
    return as_json(found, snapshots, played)


def returns_of(episodes: Sequence[Episode], rewards: Sequence[Given]) -> np.ndarray:
    """A row an episode: its true return and that by each reward, undiscounted.

    A learned reward has its absorbing state at 0 (`LearnedReward.anchored`), as on the probe.
    """
    batch = from_episodes(list(episodes))
    start = np.cumsum([0, *map(len, episodes)])[:-1]
    columns = [np.add.reduceat(read(reward, batch), start) for reward in rewards]
    return np.column_stack([[episode.return_ for episode in episodes], *columns])


def as_json(found: CrossPlay, steps: Sequence[int], played: Played) -> dict[str, Any]:
    """The matrix and its agreement, None for what is no number."""
    return {
        "snapshots": list(steps),
        "policies": [
            {
                "name": player.name,
                "kind": player.kind,
                "true_return": float(true),
                "episodes": len(player.episodes),
                "step": player.step,
            }
            for player, true in zip(played.players, found.true, strict=True)
        ],
        "learned": found.learned.tolist(),
        "agreement": [
            {"step": step} | _agreement(one) for step, one in zip(steps, found.agreement, strict=True)
        ],
        "notes": list(played.notes),
        "cost": dict(played.cost),
    }


def _agreement(of: Agreement) -> dict[str, Any]:
    return {name: {k: finite(v) for k, v in one.items()} for name, one in asdict(of).items()}


def _second_tasks(env_id: str, root: Path | None) -> tuple[list[tuple[str, ActFn]], list[str]]:
    """Policies that are after something else in the same body, and why there are not more."""
    env = make(env_id)
    seen, space = env.observation_space, env.action_space
    env.close()
    assert isinstance(seen, Box)
    assert isinstance(space, Box)
    sizes = len(seen.low), len(space.low)
    bare = split_name(env_id)[0]
    cards = [c for c in shelf.cards(root) if c.env_id != env_id and split_name(c.env_id)[0] == bare]
    found: list[tuple[str, ActFn]] = []
    notes = []
    for card in cards:
        policy, name = shelf.find(card.env_id, card.level, root).policy, f"{card.env_id} {card.level}"
        if (has := (policy.spec.obs_dim, policy.spec.action_dim)) == sizes:
            found.append((name, policy))
        else:
            # a variant may show more of the same body, or less
            notes.append(
                f"Left out: {name}, which takes observations of {has[0]} and gives actions of {has[1]}, "
                f"where the task has {sizes[0]} and {sizes[1]}."
            )
    if not found:
        notes.append(f"No second task: the shelf has no policy of {bare} with another reward.")
    if isinstance(space, OneHot):
        return found, [*notes, f"No policy holds still: actions are a choice of {len(space.low)}."]
    return [*found, (STILL, _still(space))], notes


def _still(space: Box) -> ActFn:
    middle = (space.low.astype(np.float64) + space.high) / 2.0
    return lambda obs: middle
