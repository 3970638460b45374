"""TD3 (Fujimoto et al. 2018, arXiv:1802.09477) on a reward decided as a batch is drawn.

    a'   = clip(pi'(s') + clip(N(0, s~), -c, c), -1, 1)
    y    = r(s, a, s') + gamma (1 - terminated) min_i Q_i'(s', a')
    L_Q  = E[(Q_i(s, a) - y)^2],   L_pi = -E[Q_1(s, pi(s))]  every `policy_delay` updates

The networks are those of Stable-Baselines3's `TD3`; `irl.learners.off_policy` steps and rewards.

Differs from the paper: observations may be normalised, and are clipped then; several environments may be
stepped at once and updated from less or more than once a step; the exported policy may be a moving average
of the weights; batches have 256 rows (100 there).
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import torch
from jaxtyping import Float
from stable_baselines3 import TD3
from stable_baselines3.td3.policies import Actor
from torch import Tensor

from irl.core.config import check_at_least
from irl.core.flat import linear_layers
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.learners.features import Spaces
from irl.learners.off_policy import OffPolicyLearner
from irl.learners.off_policy_config import OffPolicyConfig
from irl.learners.td3_update import TD3Update


@dataclass(frozen=True)
class TD3Config(OffPolicyConfig):
    """How the policy is improved: the keywords of SB3's TD3.

    `action_noise` is `exploration_noise`, which is Gaussian.
    """

    KIND: ClassVar[str] = "td3"
    lr: float = 1e-3
    """Adam step size of actor and critics."""
    exploration_noise: float = 0.1
    """Deviation of the noise on actions that are played; actions within +-1, as the next two."""
    policy_delay: int = 2
    """Updates of the critics for one of the actor and of the targets."""
    target_policy_noise: float = 0.2
    """Deviation of the noise on the next action."""
    target_noise_clip: float = 0.5
    """Bound of that noise."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_at_least(self, 1, "policy_delay")
        check_at_least(self, 0, "exploration_noise", "target_policy_noise", "target_noise_clip")


class TD3Learner(OffPolicyLearner[TD3Config, TD3, TD3Update]):
    """Acts always alike in a state, but for noise that it plays with; so it has no `log_pi`."""

    DISTRIBUTION = "deterministic"

    def _sb3(self, env: Spaces, common: dict[str, Any]) -> TD3:
        return TD3(
            "MlpPolicy",
            env,
            policy_delay=self.config.policy_delay,
            target_policy_noise=self.config.target_policy_noise,
            target_noise_clip=self.config.target_noise_clip,
            **common,
        )

    def _made(self, seed: int, absorbing_scale: float) -> TD3Update:
        # a stream of its own: no setting of the updates moves it
        self._noise = torch_stream(seed, "exploration", self.model.device)
        dtype = torch.bfloat16 if self.config.products == "bfloat16" else torch.float32
        return TD3Update(self.model, self._normaliser, self._rng, dtype, absorbing_scale)

    def _explore(self, features: Float[Tensor, "B F"]) -> Float[Tensor, "B A"]:
        action = self._update.act(features)
        noise = torch.randn(action.shape, generator=self._noise, device=action.device)
        return action + self.config.exploration_noise * noise

    def log_pi(self, batch: Transitions) -> Float[Tensor, "B"]:
        """Raises TypeError: nothing is drawn, so there is no density."""
        raise TypeError("TD3's policy has one action for a state and so no log pi; use SAC or PPO")

    def _actors(self) -> list[dict[str, Tensor]]:
        return [_layers(self.model.actor), _layers(self.model.actor_target)]

    def _more(self) -> dict[str, Any]:
        return {"exploration": self._noise.get_state()}

    def _load_more(self, state: dict[str, Any]) -> None:
        self._noise.set_state(state["exploration"])


def _layers(actor: Actor) -> dict[str, Tensor]:
    weights: dict[str, Tensor] = {}
    for i, layer in enumerate(linear_layers(actor.mu)):
        weights |= {f"layers.{i}.weight": layer.weight.detach(), f"layers.{i}.bias": layer.bias.detach()}
    return weights
