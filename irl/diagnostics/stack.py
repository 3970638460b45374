"""Episodes of several kinds of play put into one stack of steps, with the place of each remembered.

A stratum is one kind of play: held-out expert, random actions, a policy at the middle of a run. Distances
are taken over the stack, resampled by episode within each stratum, and can be read within one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from irl.core.types import Episode, Transitions, from_episodes
from irl.rewards.learned import LearnedReward

Given = Callable[[Transitions], Tensor | np.ndarray]
"""A reward from anywhere: a `RewardFn`, or any function of a batch that gives a number a step."""
Strata = Mapping[str, Sequence[Episode]]
"""Episodes by the name of their kind of play."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Where each of E episodes lies in a stack of N steps."""

    start: Int[np.ndarray, "E"]
    length: Int[np.ndarray, "E"]
    terminated: Bool[np.ndarray, "E"]
    """Whether the task ended it; otherwise something followed that was not recorded."""
    stratum: Int[np.ndarray, "E"]
    """Which of `names` it belongs to."""
    names: tuple[str, ...]

    @property
    def steps(self) -> int:
        """N."""
        return int(np.sum(self.length))

    @property
    def episode(self) -> Int[np.ndarray, "N"]:
        """Which episode each step belongs to."""
        return np.repeat(np.arange(len(self.length)), self.length)

    @property
    def fold(self) -> Int[np.ndarray, "E"]:
        """0 or 1: halves of each stratum by episode; all 0 where a half would be empty."""
        rank = np.zeros(len(self.stratum), dtype=np.int64)
        for name in range(len(self.names)):
            rank[self.stratum == name] = np.arange(np.sum(self.stratum == name)) + name
        # beginning with the other half in every second stratum keeps strata of one episode balanced
        return rank % 2 if len(set(rank % 2)) == 2 else np.zeros_like(rank)


@dataclass(frozen=True, eq=False)
class Stack:
    """Steps of all strata in order, and where their episodes lie."""

    batch: Transitions
    layout: Layout

    def of(self, name: str) -> Bool[np.ndarray, "N"]:
        """The steps of one stratum."""
        return (self.layout.stratum == self.layout.names.index(name))[self.layout.episode]


def stack(strata: Strata) -> Stack:
    """The steps of every stratum, one after the other.

    Raises:
        ValueError: there is no episode at all.
    """
    names = tuple(name for name, episodes in strata.items() if episodes)
    every = [episode for name in names for episode in strata[name]]
    length = np.array([len(episode) for episode in every], dtype=np.int64)
    layout = Layout(
        start=np.cumsum(length) - length,
        length=length,
        terminated=np.array([episode.terminated for episode in every], dtype=bool),
        stratum=np.repeat(np.arange(len(names)), [len(strata[name]) for name in names]),
        names=names,
    )
    return Stack(from_episodes(every), layout)


def read(reward: Given, batch: Transitions, rows: int = 20_000) -> Float[np.ndarray, "B"]:
    """The reward of each step, in float64, asked for `rows` steps at a time.

    Of a learned reward that pays a termination for all the time in the absorbing state after it, the same
    reward written without that (`LearnedReward.anchored`). A plain function may return an array.

    Raises:
        ValueError: the reward does not give one number a step.
    """
    asked = reward.anchored if isinstance(reward, LearnedReward) else reward
    parts = []
    with torch.no_grad():
        for start in range(0, len(batch), rows):
            part = batch[slice(start, start + rows)]
            given = torch.as_tensor(asked(part))
            if given.shape != (len(part),):
                raise ValueError(
                    f"expected one number a step, {len(part)} in all: the reward gave the shape "
                    f"{tuple(given.shape)}"
                )
            parts.append(given.double().cpu().numpy())
    return np.concatenate(parts)


def read_episodes(reward: Given, episodes: Sequence[Episode]) -> list[Float[np.ndarray, "_"]]:
    """The reward of each episode's steps, as `read` has it, so that their sum is a return.

    Without s_abs at 0 a sum says how long an episode was: a reward that pays each step less than nothing,
    and what follows a termination less still, would be higher the sooner one falls.
    """
    return [read(reward, from_episodes([episode])) for episode in episodes]


def plain(batch: Transitions) -> Transitions:
    """The batch without the hand-written reward and its terms, for a reward that must not read them."""
    return replace(batch, reward=None, terms={})
