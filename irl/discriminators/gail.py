"""Generative adversarial imitation learning (Ho & Ermon 2016, arXiv:1606.03476).

    D  <-  argmin  -E_expert[log D(s,a)] - E_policy[log(1 - D(s,a))]          (losses.bce)
                   + c E[(|grad logit(x)| - 1)^2]                             (regularisers.gradient_penalty)
    r  =   -log(1 - D(s,a))                                                   (maps.gail)

Differs from the paper: the expert has label 1 (the paper has 0); the gradient penalty (the paper has
none; Gulrajani et al. 2017); observations are normalised by the demonstrations' fixed moments; no
causal-entropy term here, the learner has its own; the policy step is any learner that takes a RewardFn
(the paper uses TRPO).
"""

from dataclasses import dataclass
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.config import check_at_least
from irl.core.nets import Normaliser
from irl.core.types import Metrics, Transitions
from irl.discriminators import losses, regularisers
from irl.rewards import maps
from irl.rewards.nets import LogitNet, LogitSpec


@dataclass(frozen=True)
class GAILConfig:
    """How the discriminator learns."""

    hidden: tuple[int, ...] = (100, 100)
    """Width of each hidden layer, tanh between."""
    lr: float = 1e-3
    """Adam step size."""
    gradient_penalty: float = 5.0
    """Weight of the gradient penalty; 0 turns it off."""

    def __post_init__(self) -> None:
        check_at_least(self, 0, "lr", "gradient_penalty")


class GAIL:
    """A classifier of (s, a) into expert and policy, and the reward it gives."""

    reward_map = "gail"

    def __init__(
        self,
        obs_dim: int,
        action_dim: int,
        config: GAILConfig,
        *,
        normaliser: Normaliser,
        init_rng: torch.Generator,
        rng: torch.Generator,
    ) -> None:
        """`init_rng` (on the CPU) draws the first weights; `rng` all else, and D lives on its device."""
        self.config, self.rng = config, rng
        spec = LogitSpec(obs_dim, action_dim, config.hidden)
        self.net = LogitNet(spec, normaliser, init_rng).to(rng.device)
        self.optimizer = torch.optim.Adam(self.net.parameters(), lr=config.lr)

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """High where the expert is likelier."""
        return self.net(batch)

    def reward(self, batch: Transitions) -> Float[Tensor, "B"]:
        """softplus(logit), without a gradient."""
        with torch.no_grad():
            return maps.gail(self.logits(batch))

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        """One gradient step on a batch of each. Returns the loss and the penalty before it."""
        expert_x, policy_x = self.net.inputs(expert), self.net.inputs(policy)
        loss = losses.bce(self.net.of_inputs(expert_x), self.net.of_inputs(policy_x))
        penalty = torch.zeros(())
        if self.config.gradient_penalty:
            penalty = regularisers.gradient_penalty(self.net.of_inputs, expert_x, policy_x, self.rng)
        self.optimizer.zero_grad(set_to_none=True)
        (loss + self.config.gradient_penalty * penalty).backward()
        self.optimizer.step()
        return {"discriminator/loss": loss.item(), "discriminator/gradient_penalty": penalty.item()}

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on."""
        return {
            "net": self.net.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "rng": self.rng.get_state(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another one of the same settings was."""
        self.net.load_state_dict(state["net"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.rng.set_state(state["rng"])
