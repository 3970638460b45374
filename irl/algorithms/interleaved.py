"""Adversarial imitation off policy: a discriminator's step before each of the learner's.

each update:  batch  <- replay memory, its terminations led into the absorbing state
              D      <- one step on (expert, batch)
              policy <- one step on (batch, D.reward(batch))

Discriminator and learner share the batch. The policy's side of the discriminator's data is the whole
memory, not the newest policy's steps: no importance weights (Kostrikov et al. 2019, arXiv:1809.02925,
section 4.1, which reports that leaving them out works well).

With `expert_share`, that share of the learner's batch are the expert's steps that the discriminator has just
seen, rewarded like any other: where the expert goes, critics know what is to be had before the policy has
been there, and the actor is improved there too. No action is copied. Ren et al. (2024), Hybrid Inverse
Reinforcement Learning, arXiv:2402.08848, train on such a mixture.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import torch

from irl.algorithms.adversarial import Discriminator, anneal, judge
from irl.algorithms.loop import Learner, Round
from irl.core.config import check_at_least
from irl.core.finite import check_finite, named
from irl.core.types import Metrics, Transitions, concatenate


@dataclass(frozen=True)
class InterleavedConfig:
    """How often the discriminator learns."""

    every: int = 1
    """Updates of the learner for one of the discriminator."""
    expert_share: float = 0.0
    """Share of the learner's batches that are demonstration steps, rewarded like any other."""

    ADDED: ClassVar[dict[str, Any]] = {"expert_share": 0.0}

    def __post_init__(self) -> None:
        check_at_least(self, 1, "every")
        if not 0.0 <= self.expert_share < 1.0:
            raise ValueError(f"expert_share must be in [0, 1), not {self.expert_share}")


def mixed(batch: Transitions, expert: Transitions, share: float) -> Transitions:
    """The batch with the first `share` of its rows replaced by the expert's first, to whole rows."""
    rows = round(share * len(batch))
    return concatenate([expert[:rows], batch[rows:]]) if rows else batch


def as_weighted(expert: Transitions, rng: torch.Generator) -> Transitions:
    """As many of these rows, drawn by their weights: for a learner, which reads none.

    Thinned demonstrations keep every step into the absorbing state, at a weight of 1 / rate.
    """
    if expert.weight is None:
        return expert
    rows = torch.multinomial(expert.weight, len(expert), replacement=True, generator=rng)
    return expert[rows]


class Interleaved:
    """The two players on one memory, and the demonstrations they meet over."""

    def __init__(
        self,
        learner: Learner,
        discriminator: Discriminator,
        expert: Transitions,
        schedule: InterleavedConfig,
        rng: torch.Generator,
    ) -> None:
        """`expert` goes on in the absorbing state if the learner's batches do; `rng` draws from it."""
        self.learner, self.discriminator = learner, discriminator
        self.expert, self.schedule, self.rng = expert, schedule, rng
        self.index, self._updates = 0, 0
        self._sums: Metrics = {}
        learner.start(discriminator.reward, self._before_update)

    def rounds(self, steps: int) -> Iterator[Round]:
        """Play until `steps` environment steps are taken; the last round may go past them.

        Raises:
            NotFinite: the discriminator's weights, the reward or the policy's weights are not finite.
        """
        while self.learner.env_steps < steps:
            before = self._updates
            anneal(self.discriminator, self.learner.env_steps, steps)
            batch = self.learner.collect()
            check_finite(named("discriminator", self.discriminator.state_dict()["net"]))
            taken = self._updates // self.schedule.every - before // self.schedule.every
            metrics = {name: value / taken for name, value in self._sums.items()} if taken else {}
            self._sums = {}
            metrics |= judge(self.discriminator, self.expert, batch)
            metrics |= self.learner.improve(self.discriminator.reward)
            self.index += 1
            yield Round(self.index, self.learner.env_steps, metrics)

    def _before_update(self, batch: Transitions) -> Transitions:
        self._updates += 1
        learns = self._updates % self.schedule.every == 0
        if not (learns or self.schedule.expert_share):
            return batch
        expert = self.expert.sample(len(batch), self.rng)
        if learns:
            for name, value in self.discriminator.update(expert, batch).items():
                self._sums[name] = self._sums.get(name, 0.0) + value
        if not self.schedule.expert_share:
            return batch
        return mixed(batch, as_weighted(expert, self.rng), self.schedule.expert_share)

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        return {
            "learner": self.learner.state_dict(),
            "discriminator": self.discriminator.state_dict(),
            "rng": self.rng.get_state(),
            "counts": (self.index, self._updates),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another run of the same settings was."""
        self.learner.load_state_dict(state["learner"])
        self.discriminator.load_state_dict(state["discriminator"])
        self.rng.set_state(state["rng"])
        self.index, self._updates = state["counts"]
