"""What flows through the program: episodes, batches of transitions, and rewards of them.

Axis names used in every shape: B batch, T time, O observation, A action, K reward term.
An `Episode` holds numpy arrays as the simulator made them (float64); `Transitions` holds tensors.
`from_episodes` is the one place where the first becomes the second.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

Metrics = dict[str, float]
"""Numbers of one round, by declared name."""


@dataclass(frozen=True, eq=False)
class Episode:
    """One episode from its reset to its last step: one more observation than actions.

    `terminated` says that the task ended it (the future is worth nothing), `truncated` that a time
    limit or the recording did (the future is worth something). Actions are in environment units.
    """

    obs: Float[np.ndarray, "T1 O"]
    action: Float[np.ndarray, "T A"]
    reward: Float[np.ndarray, "T"]
    terminated: bool
    truncated: bool
    terms: Mapping[str, Float[np.ndarray, "T"]] = field(default_factory=dict)
    """Terms of the hand-written reward, signed so that they add up to it."""
    infos: Mapping[str, Float[np.ndarray, "T"]] = field(default_factory=dict)
    """Other numbers of each step, e.g. `x_position`, which the observation hides."""
    seed: int | None = None
    """What the environment was reset with."""

    def __post_init__(self) -> None:
        steps = len(self.action)
        if steps == 0:
            raise ValueError("an episode has at least one step, this one has 0 actions")
        if len(self.obs) != steps + 1:
            raise ValueError(f"expected one more observation than actions: {len(self.obs)} != {steps} + 1")
        columns = {"reward": self.reward, **self.terms, **self.infos}
        for name, values in columns.items():
            if len(values) != steps:
                raise ValueError(f"expected one {name} a step: {len(values)} != {steps}")

    def __len__(self) -> int:
        return len(self.action)

    def __repr__(self) -> str:
        end = "terminated" if self.terminated else "truncated" if self.truncated else "open"
        return (
            f"Episode({len(self)} steps, obs {self.obs.shape[1]}, action {self.action.shape[1]}, "
            f"return {self.return_:.1f}, {end}, seed {self.seed})"
        )

    @property
    def return_(self) -> float:
        """Sum of the environment's own rewards, undiscounted."""
        return float(np.sum(self.reward))


@dataclass(frozen=True, eq=False)
class Transitions:
    """One batch of B steps. Indexing with a slice, mask or index tensor gives a smaller batch."""

    obs: Float[Tensor, "B O"]
    action: Float[Tensor, "B A"]
    """Environment units, clipped to the bounds: what the environment saw."""
    next_obs: Float[Tensor, "B O"]
    """The true next observation, also where an automatic reset followed."""
    terminated: Bool[Tensor, "B"]
    truncated: Bool[Tensor, "B"]
    reward: Float[Tensor, "B"] | None = None
    """The environment's own reward where it was recorded; no learner reads it."""
    terms: Mapping[str, Float[Tensor, "B"]] = field(default_factory=dict)
    weight: Float[Tensor, "B"] | None = None
    """How many steps a row stands for, where steps were left out; None is 1 for each."""
    absorbing: Bool[Tensor, "B"] | None = None
    """Whether obs is s_abs, the state after a termination, whose row of obs is zeros; None is never."""
    next_absorbing: Bool[Tensor, "B"] | None = None
    """Whether next_obs is s_abs."""

    def __post_init__(self) -> None:
        sizes = {
            name: len(value) for name, value in {**self._columns(), **self.terms}.items() if value is not None
        }
        if len(set(sizes.values())) > 1:
            raise ValueError(f"expected columns of one length: {sizes}")

    def __len__(self) -> int:
        return len(self.obs)

    def __getitem__(self, index: slice | Tensor) -> "Transitions":
        return self._map(lambda column: column[index])

    def to(self, device: torch.device | str) -> "Transitions":
        """The same batch on another device."""
        return self._map(lambda column: column.to(device))

    def minibatches(self, size: int, rng: torch.Generator) -> Iterator["Transitions"]:
        """Every step once, in an order drawn from `rng`, in batches of `size`; a rest is dropped.

        A batch smaller than `size` is yielded only when there is no full one.
        """
        order = torch.randperm(len(self), generator=rng, device=rng.device)
        for start in range(0, max(len(self) - size + 1, 1), size):
            yield self[order[start : start + size]]

    def sample(self, size: int, rng: torch.Generator) -> "Transitions":
        """`size` steps drawn with replacement from `rng`."""
        return self[torch.randint(len(self), (size,), generator=rng, device=rng.device)]

    def _columns(self) -> dict[str, Tensor | None]:
        names = ("obs", "action", "next_obs", "terminated", "truncated", "reward")
        return {name: getattr(self, name) for name in (*names, *_FILLED)}

    def _map(self, change) -> "Transitions":
        columns = {k: None if v is None else change(v) for k, v in self._columns().items()}
        return Transitions(**columns, terms={k: change(v) for k, v in self.terms.items()})  # pyright: ignore[reportArgumentType]


_FILLED = {"weight": 1.0, "absorbing": False, "next_absorbing": False}
"""Columns that may be missing, and what a missing one means in every row."""


def from_episodes(episodes: Sequence[Episode]) -> Transitions:
    """All steps of the episodes, in order: float32 for nets, reward and terms in float64.

    Terms that not every episode has are left out.

    Raises:
        ValueError: there is no episode.
    """
    if not episodes:
        raise ValueError("expected at least one episode, got none")

    def last_only(episode: Episode, value: bool) -> np.ndarray:
        flags = np.zeros(len(episode), dtype=bool)
        flags[-1] = value
        return flags

    def joined(parts: list[np.ndarray], dtype: torch.dtype) -> Tensor:
        return torch.as_tensor(np.concatenate(parts)).to(dtype)

    shared = [k for k in episodes[0].terms if all(k in episode.terms for episode in episodes)]
    return Transitions(
        obs=joined([e.obs[:-1] for e in episodes], torch.float32),
        action=joined([e.action for e in episodes], torch.float32),
        next_obs=joined([e.obs[1:] for e in episodes], torch.float32),
        terminated=joined([last_only(e, e.terminated) for e in episodes], torch.bool),
        truncated=joined([last_only(e, e.truncated) for e in episodes], torch.bool),
        reward=joined([e.reward for e in episodes], torch.float64),
        terms={k: joined([e.terms[k] for e in episodes], torch.float64) for k in shared},
    )


def concatenate(batches: Sequence[Transitions]) -> Transitions:
    """One batch of all, in order.

    Reward and terms stay where every part has them; weight and flags where any has, 1 and False elsewhere.
    """
    if not batches:
        raise ValueError("expected at least one batch, got none")
    rewards = [b.reward for b in batches if b.reward is not None]
    shared = [k for k in batches[0].terms if all(k in b.terms for b in batches)]
    return Transitions(
        obs=torch.cat([b.obs for b in batches]),
        action=torch.cat([b.action for b in batches]),
        next_obs=torch.cat([b.next_obs for b in batches]),
        terminated=torch.cat([b.terminated for b in batches]),
        truncated=torch.cat([b.truncated for b in batches]),
        reward=torch.cat(rewards) if len(rewards) == len(batches) else None,
        terms={k: torch.cat([b.terms[k] for b in batches]) for k in shared},
        **{name: _filled(name, batches) for name in _FILLED},
    )


def _filled(name: str, batches: Sequence[Transitions]) -> Tensor | None:
    columns: list[Tensor | None] = [getattr(b, name) for b in batches]
    like = next((column for column in columns if column is not None), None)
    if like is None:
        return None
    fill = _FILLED[name]
    return torch.cat(
        [like.new_full((len(b),), fill) if c is None else c for b, c in zip(batches, columns, strict=True)]
    )


@runtime_checkable
class RewardFn(Protocol):
    """A reward of a batch: hand-written, shaped, normalised, learned or frozen, all the same."""

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]: ...


@runtime_checkable
class ActFn(Protocol):
    """A policy as rollouts need it: one observation in, one action in environment units out."""

    def __call__(self, obs: Float[np.ndarray, "O"]) -> Float[np.ndarray, "A"]: ...
