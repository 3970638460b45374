"""Generative adversarial imitation learning (Ho & Ermon 2016, arXiv:1606.03476).

    D  <-  argmin  -E_expert[log D(s,a)] - E_policy[log(1 - D(s,a))]          (losses.bce, by objectives)
                   + c E[(|grad logit(x)| - 1)^2]                             (regularisers.slope_penalty)
    r  =   -log(1 - D(s,a))                                                   (maps.gail)

Differs from the paper: the expert has label 1 (the paper has 0); the gradient penalty (the paper has
none; Gulrajani et al. 2017); observations are normalised by fixed moments, the demonstrations'; no
causal-entropy term here, the learner has its own; the policy step is any learner that takes a RewardFn
(the paper uses TRPO). Other losses, rewards, penalties and the absorbing state are settings, off by default.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core import adam
from irl.core.config import check_at_least, check_widths
from irl.core.nets import Normaliser
from irl.core.schedule import rate_at
from irl.core.types import Metrics, Transitions
from irl.discriminators import losses, regularisers
from irl.discriminators.dropout import dropped
from irl.discriminators.objectives import objective
from irl.discriminators.slopes import Slopes
from irl.discriminators.switches import SwitchesConfig, check_critic, optimiser
from irl.rewards import tail
from irl.rewards.nets import LogitNet, LogitSpec


@dataclass(frozen=True)
class GAILConfig(SwitchesConfig):
    """How the discriminator learns."""

    ADDED: ClassVar[dict[str, Any]] = SwitchesConfig.ADDED | {
        "reward_map": "gail",
        "activation": "tanh",
        "penalty_center": 1.0,
        "penalty_every": 1,
        "entropy": 0.0,
        "spectral_norm": False,
        "absorbing_scale": 0.0,
        "inputs": "obs_action",
        "products": "float32",
        "lr_schedule": "constant",
    }

    hidden: tuple[int, ...] = (100, 100)
    """Width of each hidden layer."""
    lr: float = 1e-3
    """Adam step size."""
    lr_schedule: Literal["constant", "linear"] = "constant"
    """`constant`, or `linear` from `lr` to 0 over the run: the reward then comes to rest."""
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
    inputs: Literal["obs_action", "obs", "obs_next_obs", "obs_action_next_obs"] = "obs_action"
    """What D judges a step by. `obs` and `obs_next_obs` learn from demonstrations without actions."""
    products: Literal["float32", "bfloat16"] = "float32"
    """Number format of what hidden layers exchange while D learns. bfloat16 rounds to three digits.
    Where gradients are autograd's, as with spectral norm and with dropout, it is float32 regardless."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_at_least(self, 0, "lr", "gradient_penalty", "penalty_center", "entropy", "absorbing_scale")
        check_at_least(self, 1, "penalty_every")
        check_widths(self, "hidden")
        if self.loss == "wasserstein":
            check_critic(self.reward_map, self.entropy, bool(self.gradient_penalty or self.spectral_norm))


class GAIL:
    """A classifier of (s, a) into expert and policy, and the reward it gives."""

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
        spec = LogitSpec(obs_dim, action_dim, *shape, sees=config.inputs)
        self.net = LogitNet(spec, normaliser, init_rng).to(rng.device)
        dtype = torch.bfloat16 if config.products == "bfloat16" else torch.float32
        self._slopes = Slopes(self.net, dtype, dropped(config, self.net.body, rng))
        self.optimizer = optimiser(config, self._slopes.trained)
        self._updates, self._penalty = 0, 0.0

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """High where the expert is likelier."""
        return self.net(batch)

    def reward(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The mapped logit, without a gradient; at a termination with what the absorbing state pays."""
        with torch.no_grad():
            logits = self._slopes.values(self.net.inputs(batch))
            return tail.of_logits(self.net, self.reward_map, logits, batch, self.gamma)

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        """One gradient step on a batch of each. Returns the loss before it and the last penalty taken."""
        c, weights = self.config, (expert.weight, policy.weight)
        expert_x, policy_x = self.net.inputs(expert), self.net.inputs(policy)
        penalised = c.gradient_penalty > 0 and self._updates % c.penalty_every == 0
        sloped = regularisers.between(expert_x, policy_x, self.rng) if penalised else expert_x[:0]
        rows, loss_of = objective(c, expert_x, policy_x, weights, self.rng)
        logits, slopes = self._slopes(rows, sloped)
        loss = total = loss_of(logits)
        if penalised:
            penalty = regularisers.slope_penalty(slopes, c.penalty_center)
            total = total + c.gradient_penalty * c.penalty_every * penalty
            self._penalty = penalty.item()
        if c.entropy:
            total = total - c.entropy * losses.entropy_bonus(logits)
        self.optimizer.zero_grad(set_to_none=True)
        total.backward()
        adam.step(self.optimizer)
        self._slopes.refresh()
        self._updates += 1
        return {"discriminator/loss": loss.item(), "discriminator/gradient_penalty": self._penalty}

    def anneal(self, remaining: float) -> None:
        """Said before each round: which share of the run remains."""
        c = self.config
        self.optimizer.param_groups[0]["lr"] = rate_at(c.lr, c.lr_schedule, remaining)

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
        self._slopes.refresh()
        self.optimizer.load_state_dict(state["optimizer"])
        self.rng.set_state(state["rng"])
        self._updates, self._penalty = state["updates"], state["penalty"]
