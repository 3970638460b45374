"""The steps a reward is judged on: equal parts of held-out expert, fresh policy and random actions.

Expert and policy alone would not do: a reward that is right near the expert and wrong elsewhere passes
on them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float

from irl.core.rng import episode_seeds, stream
from irl.core.types import Episode, RewardFn, Transitions, from_episodes
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollout
from irl.rewards.learned import LearnedReward

STRATA = ("expert", "policy", "random")
MOST_STEPS = 5000
"""Steps of one stratum, at most."""
MOST_EPISODES = 20
"""Whole episodes of one stratum, at most."""


@dataclass(frozen=True)
class Probe:
    """By stratum: the same number of single steps, and the same number of whole episodes or fewer."""

    steps: dict[str, Transitions]
    episodes: dict[str, list[Episode]]

    def stacked(self, values: dict[str, Float[np.ndarray, "_"]]) -> Float[np.ndarray, "_"]:
        """Numbers by stratum as one column, in the order of `STRATA`."""
        return np.concatenate([values[name] for name in STRATA])


def probe(expert: Sequence[Episode], policy: Sequence[Episode], env_id: str, seed: int) -> Probe:
    """A probe of a task; `seed` draws the steps and the random episodes.

    Raises:
        ValueError: there is no expert or no policy episode.
    """
    size = min(MOST_STEPS, sum(map(len, expert)), sum(map(len, policy)))
    strata = {"expert": list(expert), "policy": list(policy), "random": random_episodes(env_id, size, seed)}
    rng = stream(seed, "probe steps")
    steps = {}
    for name, episodes in strata.items():
        every = from_episodes(episodes)
        steps[name] = every[torch.from_numpy(rng.permutation(len(every))[:size])]
    return Probe(steps, {name: episodes[:MOST_EPISODES] for name, episodes in strata.items()})


def random_episodes(env_id: str, n_steps: int, seed: int) -> list[Episode]:
    """Whole episodes of uniformly random actions, `n_steps` or more in all."""
    env = make(env_id)
    try:
        act = random_act(env.action_space, stream(seed, "probe actions"))
        seeds = iter(episode_seeds(seed, "probe", max(n_steps, MOST_EPISODES)))
        episodes, total = [], 0
        while total < n_steps or len(episodes) < MOST_EPISODES:
            episodes.append(rollout(env, act, next(seeds)))
            total += len(episodes[-1])
        return episodes
    finally:
        env.close()


def read(reward: RewardFn, batch: Transitions) -> Float[np.ndarray, "B"]:
    """The reward of each step for itself, in float64.

    What a reward adds at a termination for the time after it (`irl.rewards.tail`) is left out: it is the
    worth of a hundred steps on one of them, and the hand-written reward has nothing beside it. The step
    itself is as it was learned, into the absorbing state where there is one: of a learned reward it is
    `LearnedReward.anchored` but for a constant.
    """
    with torch.no_grad():
        if isinstance(reward, LearnedReward):
            of_steps, _ = reward.steps_and_absorbing(batch)
        else:
            of_steps = reward(replace(batch, terminated=torch.zeros_like(batch.terminated)))
        return of_steps.double().cpu().numpy()
