"""Behavioural cloning (Pomerleau 1991): the policy under which the demonstrations are likeliest.

    pi  <-  argmax  E_demonstrations[w log pi(a|s)]                 (policies.density.log_pi)

with the density of the policies that the learners have: a Gaussian whose actions are clipped to their bounds
(PPO's), or squashed into them (SAC's), or a choice. No reward is learned and no environment is stepped.

The likelihood of demonstrations that always act alike in a state grows without end as the deviation falls;
below `least_log_std` it counts no more. w is the weight of a row; steps in the absorbing state are left out,
because nobody acts there.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from irl.algorithms.loop import Round
from irl.core.config import check_at_least
from irl.core.finite import check_finite, named
from irl.core.types import Metrics, Transitions
from irl.policies.policy import Policy
from irl.policies.trainable import TrainablePolicy


@dataclass(frozen=True)
class CloningConfig:
    """How a policy is fitted to demonstrations."""

    lr: float = 1e-3
    """Adam step size."""
    batch_size: int = 256
    """Demonstration steps of one gradient step."""
    weight_decay: float = 0.0
    """Share of each weight, times `lr`, that a step takes off (AdamW)."""
    least_log_std: float = -2.0
    """Smallest log deviation of the actions, before they are squashed, that the likelihood asks for."""

    def __post_init__(self) -> None:
        check_at_least(self, 0, "lr", "weight_decay")
        check_at_least(self, 1, "batch_size")


@dataclass(frozen=True)
class WarmStartConfig(CloningConfig):
    """Behavioural cloning of the learner's policy before the first round."""

    updates: int = 0
    """Gradient steps; 0: the learner starts from random weights."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_at_least(self, 0, "updates")


class Cloning:
    """A policy, the demonstrations it is fitted to, and the steps that do so."""

    def __init__(
        self, policy: Policy, expert: Transitions, config: CloningConfig, rng: torch.Generator
    ) -> None:
        """`rng` draws the minibatches; expert and policy move to its device."""
        self.config, self.rng = config, rng
        self.expert = acted(expert).to(rng.device)
        self.net = TrainablePolicy(policy, config.least_log_std).to(rng.device)
        self.optimizer = torch.optim.AdamW(
            self.net.parameters(), lr=config.lr, weight_decay=config.weight_decay
        )

    def update(self) -> Float[Tensor, ""]:
        """One gradient step. Returns the mean log density before it."""
        batch = self.expert.sample(self.config.batch_size, self.rng)
        value = mean_log_pi(self.net, batch)
        self.optimizer.zero_grad(set_to_none=True)
        (-value).backward()
        self.optimizer.step()
        return value.detach()


class BC:
    """Behavioural cloning as what can be played: rounds of gradient steps, no environment."""

    reward_scale = 1.0

    def __init__(self, cloning: Cloning, held_out: Transitions | None, per_round: int) -> None:
        """`held_out` are demonstrations that it is measured on and not fitted to."""
        self._cloning, self._per_round = cloning, per_round
        self._held_out = acted(held_out).to(cloning.rng.device) if held_out is not None else None
        self.index = self.env_steps = 0

    @property
    def learner(self) -> "BC":
        """Where the policy comes from."""
        return self

    def rounds(self, steps: int) -> Iterator[Round]:
        """Fit until `steps` gradient steps are taken.

        Raises:
            NotFinite: a weight is NaN or infinite.
        """
        while self.env_steps < steps:
            taken = min(self._per_round, steps - self.env_steps)
            values = torch.stack([self._cloning.update() for _ in range(taken)])
            check_finite(named("policy", self._cloning.net.state_dict()))
            self.env_steps += taken
            self.index += 1
            metrics: Metrics = {"bc/log_pi": float(values.mean())}
            if self._held_out is not None:
                with torch.no_grad():
                    metrics["bc/log_pi_held_out"] = float(mean_log_pi(self._cloning.net, self._held_out))
            yield Round(self.index, self.env_steps, metrics)

    def policy(self) -> Policy:
        """The policy as it is, exported."""
        return self._cloning.net.export()

    def take_finished(self) -> list[tuple[float, int]]:
        """None: no episode is played."""
        return []

    def close(self) -> None:
        """Nothing: no environment is open."""

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        return {
            "net": self._cloning.net.state_dict(),
            "optimizer": self._cloning.optimizer.state_dict(),
            "rng": self._cloning.rng.get_state(),
            "counts": (self.index, self.env_steps),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another one of the same settings was."""
        self._cloning.net.load_state_dict(state["net"])
        self._cloning.optimizer.load_state_dict(state["optimizer"])
        self._cloning.rng.set_state(state["rng"])
        self.index, self.env_steps = state["counts"]


def acted(batch: Transitions) -> Transitions:
    """The steps in which somebody acts: all but those in the absorbing state."""
    return batch if batch.absorbing is None else batch[~batch.absorbing]


def mean_log_pi(net: TrainablePolicy, batch: Transitions) -> Float[Tensor, ""]:
    """E[w log pi(a|s)] / E[w] over the rows of a batch."""
    values = net(batch)
    return values.mean() if batch.weight is None else (batch.weight * values).sum() / batch.weight.sum()
