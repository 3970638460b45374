"""Soft actor-critic (Haarnoja et al. 2018, arXiv:1812.05905) on a reward decided as a batch is drawn.

    y    = r(s, a, s') + gamma (1 - terminated) (min_i Q_i'(s', a') - alpha log pi(a'|s'))
    L_Q  = E[(Q_i(s, a) - y)^2],   L_pi = E[alpha log pi(a|s) - min_i Q_i(s, a)]

The networks are those of Stable-Baselines3's `SAC`; `irl.learners.off_policy` steps and rewards.

With `quantiles` critics learn the distribution of returns and its highest atoms are left out: truncated
quantile critics (Kuznetsov et al. 2020, arXiv:2005.04269; `irl.learners.heads`).

Differs from the paper: observations may be normalised, and are clipped then; several environments may be
stepped at once and updated from less or more than once a step; the exported policy may be a moving
average of the weights.
"""

import contextlib
import copy
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import torch
from jaxtyping import Float
from stable_baselines3 import SAC
from torch import Tensor, nn

from irl.core.config import check_at_least
from irl.core.flat import linear_layers
from irl.core.nets import linear
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.learners.features import Spaces
from irl.learners.heads import Lowest, Quantiles
from irl.learners.off_policy import OffPolicyLearner
from irl.learners.off_policy_config import OffPolicyConfig
from irl.learners.sac_update import SACUpdate
from irl.policies import densities


@dataclass(frozen=True)
class SACConfig(OffPolicyConfig):
    """How the policy is improved: the keywords of SB3's SAC.

    There is no `use_sde`, because an exported policy has no such noise, and no `action_noise`: SAC draws its
    actions.
    """

    KIND: ClassVar[str] = "sac"
    ADDED: ClassVar[dict[str, Any]] = {
        "n_envs": 1,
        "updates_per_step": 1.0,
        "target_update_interval": 1,
        "ent_coef": "auto",
        "target_entropy": "auto",
        "n_critics": 2,
        "quantiles": 0,
        "dropped_quantiles": 2,
        "products": "float32",
        "reward_scaling": "none",
        "reward_clip": 0.0,
    }
    target_update_interval: int = 1
    """Updates between two steps of the target critics."""
    ent_coef: str = "auto"
    """Temperature: `auto` learns it from 1, `auto_0.1` from 0.1, and a number stays."""
    target_entropy: str = "auto"
    """Entropy that a learned temperature aims at, nats: a number; `auto` is minus the number of actions."""
    quantiles: int = 0
    """Atoms of each critic's distribution of returns (TQC, e.g. 25); 0: a critic says one number (SAC)."""
    dropped_quantiles: int = 2
    """Highest atoms of each critic that count in no target; only with `quantiles`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_at_least(self, 1, "target_update_interval")
        _check_number_or_auto("ent_coef", self.ent_coef, self.ent_coef.removeprefix("auto_"), 0.0)
        _check_number_or_auto("target_entropy", self.target_entropy, self.target_entropy, -math.inf)
        check_at_least(self, 0, "quantiles", "dropped_quantiles")
        if self.quantiles and self.dropped_quantiles >= self.quantiles:
            raise ValueError(
                f"dropped_quantiles must be below quantiles ({self.quantiles}), not {self.dropped_quantiles}"
            )


class SACLearner(OffPolicyLearner[SACConfig, SAC, SACUpdate]):
    """Draws its actions, and is paid for how freely it does."""

    DISTRIBUTION = "squashed_gaussian"

    def _sb3(self, env: Spaces, common: dict[str, Any]) -> SAC:
        return SAC(
            "MlpPolicy",
            env,
            ent_coef=_as_sb3(self.config.ent_coef),
            target_entropy=_as_sb3(self.config.target_entropy),
            target_update_interval=self.config.target_update_interval,
            **common,
        )

    def _made(self, seed: int, absorbing_scale: float) -> SACUpdate:
        config = self.config
        dtype = torch.bfloat16 if config.products == "bfloat16" else torch.float32
        head = Quantiles(config.quantiles, config.dropped_quantiles) if config.quantiles else Lowest()
        self._widen_critics(head.outputs, torch_stream(seed, "critics"))
        return SACUpdate(self.model, self._normaliser, self._rng, dtype, absorbing_scale, head)

    def _widen_critics(self, outputs: int, rng: torch.Generator) -> None:
        """Give SB3's critics more than one output; the targets begin as their copies."""
        critic, target = self.model.critic, self.model.critic_target
        for net, following in zip(critic.q_networks, target.q_networks, strict=True):
            assert isinstance(net, nn.Sequential)
            assert isinstance(following, nn.Sequential)
            if outputs > 1:
                of = net[-1]
                assert isinstance(of, nn.Linear)
                net[-1] = linear(of.in_features, outputs, rng).to(self.model.device)
                following[-1] = copy.deepcopy(net[-1])

    def _explore(self, features: Float[Tensor, "B F"]) -> Float[Tensor, "B A"]:
        return self._update.sample(features)

    @torch.no_grad()
    def log_pi(self, batch: Transitions) -> Float[Tensor, "B"]:
        """Log density of the batch's own actions, in environment units, under the current policy.

        `irl.policies.densities.squashed`; no normaliser moves and nothing is drawn.
        """
        inputs = self._update.inputs
        gaussian = self._update.gaussian(inputs.features(batch.obs, batch.absorbing))
        half = torch.as_tensor((self._high - self._low) / 2, device=batch.obs.device)
        return densities.squashed(inputs.scaled(batch.action), *gaussian, half)

    def _actors(self) -> list[dict[str, Tensor]]:
        actor = self.model.actor
        assert isinstance(actor.mu, nn.Linear)
        assert isinstance(actor.log_std, nn.Linear)
        weights: dict[str, Tensor] = {}
        for i, layer in enumerate([*linear_layers(actor.latent_pi), actor.mu]):
            weights |= {f"layers.{i}.weight": layer.weight, f"layers.{i}.bias": layer.bias}
        weights |= {"log_std.weight": actor.log_std.weight, "log_std.bias": actor.log_std.bias}
        return [{name: weight.detach() for name, weight in weights.items()}]

    def _more(self) -> dict[str, Any]:
        return {"log_ent_coef": self.model.log_ent_coef}

    @torch.no_grad()
    def _load_more(self, state: dict[str, Any]) -> None:
        if isinstance(self.model.log_ent_coef, Tensor):
            self.model.log_ent_coef.copy_(state["log_ent_coef"])


def _check_number_or_auto(name: str, given: str, number: str, above: float) -> None:
    with contextlib.suppress(ValueError):
        if given == "auto" or above < float(number) < math.inf:
            return
    words = "auto, auto_0.1 or a number above 0" if above == 0.0 else "auto or a number"
    raise ValueError(f"{name} must be {words}, not {given!r}")


def _as_sb3(given: str) -> str | float:
    return given if given.startswith("auto") else float(given)
