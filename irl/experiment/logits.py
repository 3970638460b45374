"""The logit of a snapshot: of AIRL's, f less the log density of the snapshot's own policy.

That policy is the exported one, the mean over the last updates, where the discriminator had the policy of the
moment: the logit is theirs up to what lay between.
"""

from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.learners import densities
from irl.policies.policy import Policy
from irl.rewards.artefact import LearnedReward
from irl.rewards.nets import LogitNet
from irl.rewards.shaped import ShapedNet

LOG_PI_BOUND = 10.0
"""What AIRL keeps log pi within, unless its settings say otherwise."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A reward and the policy of the same moment."""

    reward: LearnedReward
    policy: Policy
    log_pi_bound: float = LOG_PI_BOUND

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """High where the expert is likelier than this policy.

        A termination is judged as the discriminator saw it: as a step into s_abs where there is one.
        """
        given = self.reward.logits(batch)
        if isinstance(self.reward.net, LogitNet):
            return given
        return given - log_pi(self.policy, batch).clamp(-self.log_pi_bound, self.log_pi_bound)

    @property
    def parts(self) -> dict[str, "Part"]:
        """What the reward is made of, by name: `logit`, and of AIRL's also `f`, `g` and `h`."""
        named = ("logit", "f", "g", "h") if isinstance(self.reward.net, ShapedNet) else ("logit",)
        return {name: Part(self, name) for name in named}

    def normalised_by(self, normaliser: Normaliser) -> "Snapshot":
        """The same networks seeing observations through another normaliser."""
        net = self.reward.net
        kept = {name: value for name, value in net.state_dict().items() if not name.startswith("normaliser.")}
        other = type(net)(net.spec, normaliser, torch.Generator())  # pyright: ignore[reportArgumentType]
        other.load_state_dict({**other.state_dict(), **kept})
        return replace(self, reward=LearnedReward(self.reward.spec, other))


@dataclass(frozen=True, eq=False)
class Part:
    """One part of a snapshot's reward, as a `RewardFn`."""

    of: Snapshot
    name: str

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        if self.name == "logit":
            return self.of.logits(batch)
        net = self.of.reward.net
        assert isinstance(net, ShapedNet)
        if self.name == "f":
            return net.f(batch, self.of.reward.spec.gamma)
        return net.g(batch) if self.name == "g" else net.h(batch)


def log_pi(policy: Policy, batch: Transitions) -> Float[Tensor, "B"]:
    """Log density of the batch's own actions under a policy, as AIRL computes it (`irl.learners.densities`).

    Raises:
        ValueError: the policy chooses among actions, which AIRL does not learn from.
    """
    mean, log_std = _gaussian(policy, batch.obs)
    low, high = (torch.from_numpy(policy.weights[name]) for name in ("action_low", "action_high"))
    if policy.spec.distribution == "gaussian":
        return densities.clipped(batch.action, mean, log_std, low, high)
    if policy.spec.distribution != "squashed_gaussian":
        raise ValueError(f"a {policy.spec.distribution} policy has no density of actions")
    half = (high - low) / 2
    return densities.squashed((batch.action - low) / half - 1.0, mean, log_std, half)


def _gaussian(policy: Policy, obs: Float[Tensor, "B O"]) -> tuple[Tensor, Tensor]:
    """Mean and log standard deviation before anything is clipped or squashed."""
    w = {name: torch.from_numpy(value) for name, value in policy.weights.items()}
    bound = float(policy.weights.get("obs_clip", 10.0))
    x = ((obs - w["obs_mean"]) / w["obs_std"]).clamp(-bound, bound)
    last = len(policy.spec.hidden)
    for i in range(last):
        x = torch.nn.functional.linear(x, w[f"layers.{i}.weight"], w[f"layers.{i}.bias"])
        x = x.tanh() if policy.spec.activation == "tanh" else x.relu()
    mean = torch.nn.functional.linear(x, w[f"layers.{last}.weight"], w[f"layers.{last}.bias"])
    if "log_std" in w:
        return mean, w["log_std"].expand_as(mean)
    # the bounds within which SAC keeps its own
    return mean, torch.nn.functional.linear(x, w["log_std.weight"], w["log_std.bias"]).clamp(-20.0, 2.0)
