"""Adversarial imitation: a discriminator and a learner take turns.

each round:  batch  <- learner.collect()
             D      <- minibatch steps on (expert, batch)
             policy <- learner.improve(D.reward)
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import torch

from irl.algorithms.loop import Learner, Round
from irl.core.config import check_at_least
from irl.core.finite import check_finite, named
from irl.core.types import Metrics, Transitions


@dataclass(frozen=True)
class ScheduleConfig:
    """How long the discriminator learns in each round."""

    batch_size: int = 256
    """Expert and policy transitions of one gradient step, each."""
    epochs: int = 5
    """Passes over each rollout. With too few D stays behind the policy and leads it astray (its loss is
    then above log 4); with many in the first rounds it is certain before the policy can follow."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "batch_size", "epochs")


@runtime_checkable
class Discriminator(Protocol):
    """What tells the expert from the policy, and rewards the likeness."""

    def logits(self, batch: Transitions) -> torch.Tensor: ...
    def reward(self, batch: Transitions) -> torch.Tensor: ...
    def update(self, expert: Transitions, policy: Transitions) -> Metrics: ...
    def state_dict(self) -> dict[str, Any]: ...
    def load_state_dict(self, state: dict[str, Any]) -> None: ...


@torch.no_grad()
def judge(discriminator: Discriminator, expert: Transitions, policy: Transitions) -> Metrics:
    """How well it tells the demonstrations from these steps of the policy."""
    of_expert, of_policy = discriminator.logits(expert), discriminator.logits(policy)
    return {
        "discriminator/accuracy_expert": float((of_expert > 0).double().mean()),
        "discriminator/accuracy_policy": float((of_policy < 0).double().mean()),
        "discriminator/logit_expert": float(of_expert.mean()),
        "discriminator/logit_policy": float(of_policy.mean()),
    }


class Adversarial:
    """The two players, and the demonstrations they meet over."""

    def __init__(
        self,
        learner: Learner,
        discriminator: Discriminator,
        expert: Transitions,
        schedule: ScheduleConfig,
        rng: torch.Generator,
    ) -> None:
        """`rng` draws the discriminator's minibatches."""
        self.learner, self.discriminator = learner, discriminator
        self.expert, self.schedule, self.rng = expert, schedule, rng
        self.index = 0
        learner.start(discriminator.reward)

    def rounds(self, steps: int) -> Iterator[Round]:
        """Play until `steps` environment steps are taken; the last round may go past them.

        Raises:
            NotFinite: the discriminator's weights, the reward or the policy's weights are not finite.
        """
        while self.learner.env_steps < steps:
            batch = self.learner.collect()
            # Discriminator first: the rollout is then rewarded by what was just fitted to it.
            metrics = self._fit(batch)
            metrics |= self.learner.improve(self.discriminator.reward)
            self.index += 1
            yield Round(self.index, self.learner.env_steps, metrics)

    def _fit(self, policy: Transitions) -> Metrics:
        updates = [
            self.discriminator.update(self.expert.sample(len(batch), self.rng), batch)
            for _ in range(self.schedule.epochs)
            for batch in policy.minibatches(self.schedule.batch_size, self.rng)
        ]
        check_finite(named("discriminator", self.discriminator.state_dict()["net"]))
        means = {name: sum(u[name] for u in updates) / len(updates) for name in updates[0]}
        return means | judge(self.discriminator, self.expert, policy)

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        return {
            "learner": self.learner.state_dict(),
            "discriminator": self.discriminator.state_dict(),
            "rng": self.rng.get_state(),
            "index": self.index,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another run of the same settings was."""
        self.learner.load_state_dict(state["learner"])
        self.discriminator.load_state_dict(state["discriminator"])
        self.rng.set_state(state["rng"])
        self.index = state["index"]
