"""Generative adversarial imitation learning (Ho & Ermon 2016, arXiv:1606.03476).

    D  <-  argmin  -E_expert[log D(s,a)] - E_policy[log(1 - D(s,a))]          (losses.bce)
                   + c E[(|grad logit(x)| - 1)^2]                             (regularisers.gradient_penalty)
    r  =   -log(1 - D(s,a))                                                   (maps.gail)

Differs from the paper: the expert has label 1 (the paper has 0); the gradient penalty (the paper has
none; Gulrajani et al. 2017); observations are normalised by the demonstrations' fixed moments; no
causal-entropy term here, the learner has its own; the policy step is any learner that takes a RewardFn
(the paper uses TRPO). Other rewards, penalties and the absorbing state are settings, off by default.
"""

from dataclasses import dataclass
from typing import Any, Literal

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.config import check_at_least
from irl.core.nets import Normaliser
from irl.core.types import Metrics, Transitions
from irl.discriminators import losses, regularisers
from irl.rewards import tail
from irl.rewards.nets import LogitNet, LogitSpec


@dataclass(frozen=True)
class GAILConfig:
    """How the discriminator learns."""

    hidden: tuple[int, ...] = (100, 100)
    """Width of each hidden layer."""
    lr: float = 1e-3
    """Adam step size."""
    gradient_penalty: float = 5.0
    """Weight of the gradient penalty; 0 turns it off."""
    reward_map: Literal["gail", "logit", "log_d", "fairl"] = "gail"
    """From the logit to the reward; irl/rewards/maps.py says what each does where episodes end early."""
    activation: Literal["tanh", "relu"] = "tanh"
    """Between the layers."""
    penalty_center: float = 1.0
    """The slope that the penalty pulls to; 0 for a zero-centred penalty."""
    penalty_every: int = 1
    """The penalty is taken every so many updates, with as many times its weight: its mean stays. The slope
    is then free to drift in between, and the update without it costs about half."""
    entropy: float = 0.0
    """Weight of the entropy of D, which keeps it from being sure."""
    spectral_norm: bool = False
    """Divide each layer by its largest singular value: the slope of the logit is then at most 1."""
    absorbing_scale: float = 0.0
    """Distance of the absorbing state from all others; 0: there is none."""

    def __post_init__(self) -> None:
        check_at_least(self, 0, "lr", "gradient_penalty", "penalty_center", "entropy", "absorbing_scale")
        check_at_least(self, 1, "penalty_every")


class GAIL:
    """A classifier of (s, a) into expert and policy, and the reward it gives."""

    fused = False
    """Whether Adam is one kernel: 0.3 ms less an update, and other roundings."""

    def __init__(
        self,
        obs_dim: int,
        action_dim: int,
        config: GAILConfig,
        *,
        normaliser: Normaliser,
        init_rng: torch.Generator,
        rng: torch.Generator,
        gamma: float = 0.99,
    ) -> None:
        """`init_rng` (on the CPU) draws the first weights; `rng` all else, and D lives on its device.

        `gamma` discounts what the absorbing state pays after a termination; without one it says nothing.
        """
        self.config, self.rng, self.gamma, self.reward_map = config, rng, gamma, config.reward_map
        shape = (config.hidden, config.activation, config.absorbing_scale, config.spectral_norm)
        self.net = LogitNet(LogitSpec(obs_dim, action_dim, *shape), normaliser, init_rng).to(rng.device)
        self.optimizer = torch.optim.Adam(self.net.parameters(), lr=config.lr, fused=self.fused or None)
        self._updates, self._penalty = 0, 0.0

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """High where the expert is likelier."""
        return self.net(batch)

    def reward(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The mapped logit, without a gradient; at a termination with what the absorbing state pays."""
        with torch.no_grad():
            return tail.reward(self.net, self.reward_map, batch, self.gamma)

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        """One gradient step on a batch of each. Returns the loss before it and the last penalty taken."""
        self.net.iterate()
        expert_x, policy_x = self.net.inputs(expert), self.net.inputs(policy)
        of_expert, of_policy = self.net.of_inputs(expert_x), self.net.of_inputs(policy_x)
        loss = losses.bce(of_expert, of_policy, expert.weight, policy.weight)
        total = loss + self._regularisation(expert_x, policy_x, torch.cat([of_expert, of_policy]))
        self.optimizer.zero_grad(set_to_none=True)
        total.backward()
        self.optimizer.step()
        self._updates += 1
        return {"discriminator/loss": loss.item(), "discriminator/gradient_penalty": self._penalty}

    def _regularisation(
        self, expert_x: Float[Tensor, "B I"], policy_x: Float[Tensor, "C I"], logits: Float[Tensor, "D"]
    ) -> Float[Tensor, ""]:
        c, sum_ = self.config, logits.new_zeros(())
        if c.gradient_penalty and self._updates % c.penalty_every == 0:
            logit, center = self.net.of_inputs, c.penalty_center
            penalty = regularisers.gradient_penalty(logit, expert_x, policy_x, self.rng, center)
            sum_ = c.gradient_penalty * c.penalty_every * penalty
            self._penalty = penalty.item()
        return sum_ - c.entropy * losses.entropy_bonus(logits) if c.entropy else sum_

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on."""
        return {
            "net": self.net.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "rng": self.rng.get_state(),
            "updates": self._updates,
            "penalty": self._penalty,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another one of the same settings was."""
        self.net.load_state_dict(state["net"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.rng.set_state(state["rng"])
        self._updates, self._penalty = state["updates"], state["penalty"]
