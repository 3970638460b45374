"""A probe: whole episodes of several kinds of play, each with the hash of every number in it.

The base strata are the same for every run of a task, so numbers compared across runs use these only. A run's
own policies can be added as further strata.
"""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from irl.core.types import Episode

BASE = ("expert", "medium", "noisy expert", "random")
"""Strata that every run of a task shares."""


@dataclass(frozen=True, eq=False)
class ProbeSet(Mapping[str, Sequence[Episode]]):
    """Episodes by stratum; a mapping, so `irl.diagnose` takes it as it is."""

    env_id: str
    strata: Mapping[str, tuple[Episode, ...]]
    about: Mapping[str, str] = field(default_factory=dict)
    """What plays in each stratum."""

    def __getitem__(self, name: str) -> tuple[Episode, ...]:
        return self.strata[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.strata)

    def __len__(self) -> int:
        return len(self.strata)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name} {sum(map(len, e))}" for name, e in self.strata.items())
        return f"ProbeSet({self.env_id}, steps: {sizes}; base {self.base_sha256[:12]})"

    @property
    def base(self) -> "ProbeSet":
        """The strata that every run of the task shares, alone."""
        return self.only(name for name in self.strata if name in BASE)

    def only(self, names: Iterator[str] | Sequence[str]) -> "ProbeSet":
        """Some of the strata."""
        return ProbeSet(self.env_id, {name: self.strata[name] for name in names}, self.about)

    @property
    def base_sha256(self) -> str:
        """One hash of the base strata: probes with the same one give numbers that can be compared."""
        parts = [f"{name}:{sha256(self.strata[name])}" for name in sorted(self.base)]
        return hashlib.sha256("\n".join([self.env_id, *parts]).encode()).hexdigest()


def sha256(episodes: Sequence[Episode]) -> str:
    """Hexadecimal hash of every number of the episodes, in their order."""
    digest = hashlib.sha256()
    for episode in episodes:
        ends = np.array([episode.terminated, episode.truncated])
        fixed = {"obs": episode.obs, "action": episode.action, "reward": episode.reward, "ends": ends}
        numbers = fixed | {f"terms/{k}": v for k, v in episode.terms.items()}
        numbers |= {f"infos/{k}": v for k, v in episode.infos.items()}
        for name in sorted(numbers):
            values = np.ascontiguousarray(numbers[name])
            digest.update(f"{name} {values.dtype.str} {values.shape}".encode())
            digest.update(values.tobytes())
    return digest.hexdigest()
