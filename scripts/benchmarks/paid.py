"""What a step of a saved reward pays each of some policies, above what the absorbing state pays a step.

    python scripts/benchmarks/paid.py runs/airl-hopper --policies expert medium FILE.safetensors

A policy is a level of the shelf or a file; beside them play one that never acts and one that acts at random.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from irl.core.records import open_run
from irl.core.types import ActFn, from_episodes
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollouts
from irl.policies import shelf
from irl.policies.policy import load_policy
from irl.rewards.artefact import load_reward
from irl.rewards.averaged import averaged, so_far


@dataclass(frozen=True)
class Settings:
    """Whose reward, and who plays."""

    run: tyro.conf.Positional[Path]
    """Run folder whose reward it is."""
    policies: tuple[str, ...] = ("expert", "medium")
    """Levels of the shelf, or policy files."""
    shares: tuple[float, ...] = (0.125, 0.5, 1.0)
    """Which snapshots: shares of the run's steps."""
    part: str | None = None
    """Of AIRL's reward; g unless given."""
    average: bool = False
    """The mean of the rewards so far in place of each snapshot's own."""
    episodes: int = 3
    """Of each policy."""
    seed: int = 900
    """Of the first episode."""


def players(env_id: str, policies: tuple[str, ...]) -> dict[str, ActFn]:
    """Who plays, by name."""
    env = make(env_id)
    space = env.action_space
    env.close()
    nothing = np.zeros(space.shape or (), np.float32)
    return {
        **{name: _loaded(env_id, name) for name in policies},
        "no action": lambda obs: nothing,
        "random": random_act(space, np.random.default_rng(0)),
    }


def _loaded(env_id: str, name: str) -> ActFn:
    return load_policy(name) if Path(name).suffix else shelf.find(env_id, name).policy


def main(settings: Settings) -> None:
    """Print a line a snapshot and policy."""
    run = open_run(settings.run)
    env_id, snapshots = run.config["env_id"], run.snapshots()
    seeds = range(settings.seed, settings.seed + settings.episodes)
    played = {name: rollouts(env_id, act, seeds) for name, act in players(env_id, settings.policies).items()}
    for share in settings.shares:
        step = min(snapshots, key=lambda at: abs(at - share * max(snapshots)))
        reward = load_reward(snapshots[step] / "reward", settings.part)
        if settings.average:
            used = so_far(snapshots, step).values()
            reward = averaged([load_reward(path / "reward", settings.part) for path in used])
        for name, episodes in played.items():
            paid = reward.anchored(from_episodes(list(episodes)))
            length = np.mean([len(episode) for episode in episodes])
            print(
                f"{step:>9,}  {name:<30.30} {length:6.0f} steps  {paid.mean():6.2f} ± {paid.std():.2f} a step"
            )


if __name__ == "__main__":
    main(tyro.cli(Settings))
