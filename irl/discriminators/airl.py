"""Adversarial inverse reinforcement learning (Fu et al. 2018, arXiv:1710.11248).

    f(s, a, s') = g(s, a) + gamma h(s') - h(s)                                        (rewards.shaped)
    D           = exp f / (exp f + pi(a|s)),   so   logit = f(s, a, s') - log pi(a|s)
    D  <-  argmin  -E_expert[log D] - E_policy[log(1 - D)]                            (losses.bce)
                   + c_f E[(|grad f| - 1)^2] + c_g E[|grad g|^2] + c_h E[|grad h|^2]  (regularisers)
    r  =   log D - log(1 - D) = f - log pi,   or f

At the optimum the logit is the log ratio of the expert's density to the policy's, whatever log pi is; taking
log pi off is what lets f stand still while the policy moves. A learner that maximises the sum of f - log pi
maximises that of f and its own entropy. A learner that has an entropy bonus is given f, or it would be paid
for entropy twice.

log pi is asked anew at each update, of expert and policy rows alike, of the actions that were taken, under
the policy as it is now, and kept within +-log_pi_bound: under a policy nearly sure of itself an action of
another one has -50. In s_abs nobody acts, and log pi is 0.

Differs from the paper: gamma is the learner's own (the authors' code has 1); the penalties and the bound on
log pi (the paper has neither); g and h of 100-100 tanh on observations normalised by the demonstrations'
fixed moments; terminations lead into s_abs, where the paper has none; the policy learns from f - log pi or f
(the authors' code from g).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.config import check_at_least, check_widths
from irl.core.nets import Normaliser
from irl.core.schedule import rate_at
from irl.core.types import Metrics, Transitions
from irl.discriminators import regularisers
from irl.discriminators.dropout import dropped
from irl.discriminators.objectives import of_logits
from irl.discriminators.refused import check_defined
from irl.discriminators.shaped_slopes import ShapedSlopes, Slopes, as_rows, from_rows, joined
from irl.discriminators.switches import SwitchesConfig, optimiser
from irl.rewards.shaped import ShapedNet, ShapedSpec


@dataclass(frozen=True)
class AIRLConfig(SwitchesConfig):
    """How g and h learn."""

    ADDED: ClassVar[dict[str, Any]] = SwitchesConfig.ADDED | {"lr_schedule": "constant"}

    inputs: Literal["obs", "obs_action", "obs_next_obs", "obs_action_next_obs"] = "obs_action"
    """What g sees. `obs` is for a reward to be taken where the dynamics are others; it imitates less well.
    The last two are refused: a g that sees the next state can be any shaping itself."""
    hidden: tuple[int, ...] = (100, 100)
    """Width of each hidden layer of g."""
    potential_hidden: tuple[int, ...] = (100, 100)
    """Width of each hidden layer of h."""
    activation: Literal["tanh", "relu"] = "tanh"
    """Between the layers."""
    lr: float = 1e-3
    """Adam step size."""
    lr_schedule: Literal["constant", "linear"] = "constant"
    """`constant`, or `linear` from `lr` to 0 over the run: the reward then comes to rest."""
    reward: Literal["f", "f-log-pi"] = "f-log-pi"
    """What the learner is paid. `f-log-pi` pays for entropy, so the learner must not; `f` does not."""
    terminal: Literal["absorbing", "mask"] = "absorbing"
    """After a termination: `absorbing`, a state with g and h of its own; `mask`, h is left out and nothing
    follows, so that with rewards below 0 ending an episode pays."""
    absorbing_scale: float = 10.0
    """Distance of the absorbing state from all others, where there is one."""
    log_pi_bound: float = 2.0
    """Log pi of an action is kept within this of 0. Where it may be large D tells the two by it instead of by
    f, and a policy paid f - log pi is paid for noise without end."""
    gradient_penalty: float = 10.0
    """Weight of the penalty that pulls the slope of f to 1; 0 turns it off."""
    reward_penalty: float = 0.0
    """Weight of the penalty that pulls the slope of g alone to 0."""
    potential_penalty: float = 0.0
    """Weight of the penalty that pulls the slope of h alone to 0."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_defined(self.loss, self.mixup, self.inputs)
        check_at_least(self, 0, "lr", "gradient_penalty", "reward_penalty", "potential_penalty")
        check_widths(self, "hidden", "potential_hidden")
        for name in ("absorbing_scale", "log_pi_bound"):
            if (value := getattr(self, name)) <= 0:
                raise ValueError(f"{name} must be above 0, not {value}")

    @property
    def scale(self) -> float:
        """Distance of s_abs; 0 where there is none."""
        return self.absorbing_scale if self.terminal == "absorbing" else 0.0


class AIRL:
    """A classifier of (s, a, s') that is made of g, h and the policy itself, and the reward it gives."""

    reward_map = "g"
    """What a saved reward pays unless asked for f."""

    def __init__(
        self,
        obs_dim: int,
        action_dim: int,
        config: AIRLConfig,
        *,
        log_pi: Callable[[Transitions], Tensor],
        gamma: float,
        normaliser: Normaliser,
        init_rng: torch.Generator,
        rng: torch.Generator,
    ) -> None:
        """`init_rng` (on the CPU) draws the first weights; `rng` all else, and g and h live on its device.

        Args:
            log_pi: log density of a batch's own actions under the policy as it is when asked.
            gamma: discount of the learner that is paid.
        """
        c = self.config = config
        self.rng, self.gamma, self._log_pi = rng, gamma, log_pi
        sees = "obs" if c.inputs == "obs" else "obs_action"
        shape = (c.hidden, c.potential_hidden, c.activation, sees, c.scale, c.log_pi_bound)
        net = self.net = ShapedNet(ShapedSpec(obs_dim, action_dim, *shape), normaliser, init_rng).to(
            rng.device
        )
        of_g, of_h = dropped(c, net.reward, rng), dropped(c, net.potential, rng)
        self._slopes = ShapedSlopes(net, gamma, (of_g, of_h) if of_g and of_h else None)
        self.optimizer = optimiser(c, self._slopes.trained)

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The logit f - log pi: high where the expert is likelier."""
        return self.net.f(batch, self.gamma) - self.log_pi(batch)

    def log_pi(self, batch: Transitions) -> Float[Tensor, "B"]:
        """Log density of the batch's own actions under the current policy, bounded; 0 in s_abs."""
        bound = self.config.log_pi_bound
        bounded = self._log_pi(batch).clamp(-bound, bound)
        return bounded if batch.absorbing is None else bounded.masked_fill(batch.absorbing, 0.0)

    def reward(self, batch: Transitions) -> Float[Tensor, "B"]:
        """What the learner is paid, without a gradient; at a termination with what s_abs pays."""
        with torch.no_grad():
            f = self.net.paid("f", batch, self.gamma)
            return f if self.config.reward == "f" else f - self.log_pi(batch)

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        """One gradient step on a batch of each, of one size. Returns the loss and penalty before it."""
        n, of_expert, of_policy = len(expert), self.net.inputs(expert), self.net.inputs(policy)
        log_pi = torch.cat([self.log_pi(expert), self.log_pi(policy)])
        mixed = regularisers.between(as_rows(of_expert), as_rows(of_policy), self.rng)
        f, slopes = self._slopes(joined(of_expert, of_policy), from_rows(mixed, of_expert))
        logits = f - log_pi
        loss = of_logits(self.config, logits[:n], logits[n:], (expert.weight, policy.weight))
        of_f, others = self._penalties(slopes)
        self.optimizer.zero_grad(set_to_none=True)
        (loss + self.config.gradient_penalty * of_f + others).backward()
        self.optimizer.step()
        at_bound = log_pi.abs() >= self.config.log_pi_bound
        return {
            "discriminator/loss": loss.item(),
            "discriminator/gradient_penalty": of_f.item(),
            "airl/log_pi_expert": log_pi[:n].mean().item(),
            "airl/log_pi_policy": log_pi[n:].mean().item(),
            "airl/log_pi_at_bound": at_bound.float().mean().item(),
        }

    def _penalties(self, slopes: Slopes) -> tuple[Float[Tensor, ""], Float[Tensor, ""]]:
        """That of f before its weight, and those of g and h."""
        of_g = regularisers.slope_penalty(slopes.g, 0.0)
        of_h = regularisers.slope_penalty(slopes.h, 0.0)
        others = self.config.reward_penalty * of_g + self.config.potential_penalty * of_h
        return regularisers.slope_penalty(slopes.f), others

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
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another one of the same settings was."""
        self.net.load_state_dict(state["net"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.rng.set_state(state["rng"])
