"""How likely an exported policy was to act as a batch did, in torch and for all rows at once."""

from collections.abc import Callable, Mapping

import torch
import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.nets import CLIP
from irl.core.types import Transitions
from irl.policies import densities
from irl.policies.policy import Policy, PolicySpec

PHI: dict[str, Callable[[Tensor], Tensor]] = {"tanh": torch.tanh, "relu": F.relu}
"""Between the layers."""

BOUNDS = (-20.0, 2.0)
"""Of a log deviation that depends on the state, as SB3's SAC keeps it."""


def log_pi(
    spec: PolicySpec, weights: Mapping[str, Tensor], batch: Transitions, least_log_std: float = BOUNDS[0]
) -> Float[Tensor, "B"]:
    """Log pi(a|s) of a batch's own actions, in environment units; `weights` are named as `Policy` names them.

    `irl.policies.densities.clipped` for Gaussian actions, `squashed` for those of SAC, and for a choice the
    logarithm of its probability. Rows in the absorbing state, where nobody acts, mean nothing.

    Args:
        least_log_std: a smaller log deviation counts as this one.
    Raises:
        ValueError: the policy is deterministic.
    """
    if spec.distribution == "deterministic":
        raise ValueError("a deterministic policy has no density, so no log pi")
    clip, phi = float(weights.get("obs_clip", CLIP)), PHI[spec.activation]
    x = ((batch.obs - weights["obs_mean"]) / weights["obs_std"]).clamp(-clip, clip)
    for i in range(len(spec.hidden)):
        x = phi(F.linear(x, weights[f"layers.{i}.weight"], weights[f"layers.{i}.bias"]))
    last = f"layers.{len(spec.hidden)}"
    mean = F.linear(x, weights[f"{last}.weight"], weights[f"{last}.bias"])
    if spec.distribution == "categorical":
        return (F.log_softmax(mean, 1) * batch.action).sum(1)
    if "log_std" in weights:
        log_std = weights["log_std"].clamp(min=least_log_std).expand_as(mean)
    else:
        head = F.linear(x, weights["log_std.weight"], weights["log_std.bias"])
        log_std = head.clamp(max(BOUNDS[0], least_log_std), BOUNDS[1])
    low, high = weights["action_low"], weights["action_high"]
    if spec.distribution == "gaussian":
        return densities.clipped(batch.action, mean, log_std, low, high)
    half = (high - low) / 2
    return densities.squashed((batch.action - (low + high) / 2) / half, mean, log_std, half)


class Density(nn.Module):
    """log pi of a batch's own actions under a policy that does not change (`log_pi`)."""

    def __init__(self, policy: Policy) -> None:
        """Raises ValueError for a choice of actions, and for a policy that never draws: no densities."""
        super().__init__()
        self.spec = policy.spec
        if self.spec.distribution == "categorical":
            raise ValueError(f"a choice of actions has no density, and {policy!r} makes one")
        if not policy.draws:
            raise ValueError(f"a deterministic policy has no density, and {policy!r} is one")
        for name, value in policy.weights.items():
            self.register_buffer(name.replace(".", "_"), torch.from_numpy(value.copy()))
        self._names = list(policy.weights)

    @torch.no_grad()
    def forward(self, batch: Transitions) -> Float[Tensor, "B"]:
        """One number a row."""
        weights = {name: self.get_buffer(name.replace(".", "_")) for name in self._names}
        return log_pi(self.spec, weights, batch)
