"""Adversarial imitation: a discriminator and a learner take turns.

each round:  batch  <- learner.collect()
             D      <- minibatch steps on (expert, batch and earlier ones)
             policy <- learner.improve(D.reward)
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import torch

from irl.algorithms.loop import Learner, Round
from irl.algorithms.negatives import Negatives
from irl.core.config import check_at_least
from irl.core.finite import check_finite, named
from irl.core.types import Metrics, Transitions


@dataclass(frozen=True)
class ScheduleConfig:
    """How long the discriminator learns in each round, and from which of the policy's steps."""

    ADDED: ClassVar[dict[str, Any]] = {"memory": 0}

    batch_size: int = 256
    """Expert and policy transitions of one gradient step, each."""
    epochs: int = 5
    """Passes over each rollout, or as long as one with a memory. With too few D stays behind the policy and
    leads it astray (its loss is then above log 4); with many in the first rounds it is certain before the
    policy can follow."""
    memory: int = 0
    """Steps of older rollouts that are drawn from as well, a uniform sample of all; 0 keeps none. A reward
    that is told of the newest policies alone forgets what was wrong with the ones before them, and pays a
    fresh policy for it. They are in each checkpoint, too: 200,000 are 170 MB on Ant."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "batch_size", "epochs")
        check_at_least(self, 0, "memory")


@dataclass(frozen=True)
class ReplayedScheduleConfig(ScheduleConfig):
    """The same with longer first rounds, and with the steps of earlier rollouts beside the newest."""

    epochs: int = 5
    """Passes as long as a rollout in each round, over the newest rollouts and the memory."""
    warmup_rounds: int = 5
    """Rounds of `warmup_epochs` passes before the others."""
    warmup_epochs: int = 20
    """Passes in each of them."""
    negatives: int = 5
    """Rollouts that steps are drawn from, the newest included."""
    memory: int = 200_000
    """Steps of older rollouts that are drawn from as well, a uniform sample of all; 0 keeps none."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_at_least(self, 1, "negatives", "warmup_epochs")
        check_at_least(self, 0, "warmup_rounds")


@runtime_checkable
class Discriminator(Protocol):
    """What tells the expert from the policy, and rewards the likeness."""

    def logits(self, batch: Transitions) -> torch.Tensor: ...
    def reward(self, batch: Transitions) -> torch.Tensor: ...
    def update(self, expert: Transitions, policy: Transitions) -> Metrics: ...
    def state_dict(self) -> dict[str, Any]: ...
    def load_state_dict(self, state: dict[str, Any]) -> None: ...


@runtime_checkable
class Annealed(Protocol):
    """A discriminator that wants to know how much of the run remains."""

    def anneal(self, remaining: float) -> None:
        """Said before each round: the share of the run's steps that is not yet taken."""
        ...


def anneal(discriminator: Discriminator, taken: int, steps: int) -> None:
    """Tell it, if it wants to know."""
    if isinstance(discriminator, Annealed):
        discriminator.anneal(1.0 - taken / steps)


@torch.no_grad()
def judge(discriminator: Discriminator, expert: Transitions, policy: Transitions) -> Metrics:
    """How well it tells the demonstrations, by their weights, from these steps of the policy."""
    of_expert, of_policy = discriminator.logits(expert), discriminator.logits(policy)
    weight = torch.ones_like(of_expert) if expert.weight is None else expert.weight
    share = weight.double() / weight.double().sum()
    return {
        "discriminator/accuracy_expert": float((share * (of_expert > 0)).sum()),
        "discriminator/accuracy_policy": float((of_policy < 0).double().mean()),
        "discriminator/logit_expert": float((share * of_expert).sum()),
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
        *,
        absorbing: bool = False,
    ) -> None:
        """`rng` draws the discriminator's minibatches, and what it remembers.

        With `absorbing` it is shown rollouts whose terminations lead into the absorbing state; `expert` then
        does too. The learner is rewarded for the steps it took.
        """
        self.learner, self.discriminator = learner, discriminator
        self.expert, self.schedule, self.rng = expert, schedule, rng
        replayed = schedule if isinstance(schedule, ReplayedScheduleConfig) else None
        rollouts = replayed.negatives if replayed else 1
        self._negatives = Negatives(rollouts, rng, memory=schedule.memory, absorbing=absorbing)
        self.index = 0
        learner.start(discriminator.reward)

    def rounds(self, steps: int) -> Iterator[Round]:
        """Play until `steps` environment steps are taken; the last round may go past them.

        Raises:
            NotFinite: the discriminator's weights, the reward or the policy's weights are not finite.
        """
        while self.learner.env_steps < steps:
            anneal(self.discriminator, self.learner.env_steps, steps)
            batch = self.learner.collect()
            # Discriminator first: the rollout is then rewarded by what was just fitted to it.
            metrics = self._fit(batch)
            metrics |= self.learner.improve(self.discriminator.reward)
            self.index += 1
            yield Round(self.index, self.learner.env_steps, metrics)

    @property
    def _epochs(self) -> int:
        """Passes of the round that is under way."""
        schedule = self.schedule
        if isinstance(schedule, ReplayedScheduleConfig) and self.index < schedule.warmup_rounds:
            return schedule.warmup_epochs
        return schedule.epochs

    def _fit(self, policy: Transitions) -> Metrics:
        drawn = self._negatives.with_newest(policy)
        size = self.schedule.batch_size
        of_one_pass = max(len(policy) // size, 1)
        updates = [
            self.discriminator.update(self.expert.sample(len(batch), self.rng), batch)
            for _ in range(self._epochs)
            for batch in itertools.islice(drawn.minibatches(size, self.rng), of_one_pass)
        ]
        check_finite(named("discriminator", self.discriminator.state_dict()["net"]))
        means = {name: sum(u[name] for u in updates) / len(updates) for name in updates[0]}
        return means | judge(self.discriminator, self.expert, policy)

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        return {
            "learner": self.learner.state_dict(),
            "discriminator": self.discriminator.state_dict(),
            "negatives": self._negatives.state_dict(),
            "rng": self.rng.get_state(),
            "index": self.index,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another run of the same settings was."""
        self.learner.load_state_dict(state["learner"])
        self.discriminator.load_state_dict(state["discriminator"])
        self._negatives.load_state_dict(state["negatives"], self.expert.obs.device)
        self.rng.set_state(state["rng"])
        self.index = state["index"]
