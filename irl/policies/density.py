"""How likely an exported policy was to act as a batch did, in torch and for all rows at once."""

import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.nets import ACTIVATIONS, CLIP
from irl.core.types import Transitions
from irl.policies import densities
from irl.policies.policy import Policy

BOUNDS = (-20.0, 2.0)
"""Of a log deviation that depends on the state, as SB3's SAC keeps it."""


class Density(nn.Module):
    """log pi(a|s) of a batch's own actions, in environment units, under a policy that does not change.

    `irl.policies.densities.clipped` for Gaussian actions, `squashed` for those of SAC.
    """

    def __init__(self, policy: Policy) -> None:
        """Raises ValueError for a choice of actions, which has probabilities and no density."""
        super().__init__()
        self.spec = spec = policy.spec
        if spec.distribution == "categorical":
            raise ValueError(f"a choice of actions has no density, and {policy!r} makes one")
        for name, value in policy.weights.items():
            self.register_buffer(name.replace(".", "_"), torch.from_numpy(value.copy()))
        self._clip = float(policy.weights.get("obs_clip", CLIP))
        self._phi = ACTIVATIONS[spec.activation]()

    @torch.no_grad()
    def forward(self, batch: Transitions) -> Float[Tensor, "B"]:
        """One number a row; rows in the absorbing state, where nobody acts, mean nothing."""
        weights = dict(self.named_buffers())
        x = ((batch.obs - weights["obs_mean"]) / weights["obs_std"]).clamp(-self._clip, self._clip)
        for i in range(len(self.spec.hidden)):
            x = self._phi(nn.functional.linear(x, *self._layer(f"layers_{i}")))
        mean = nn.functional.linear(x, *self._layer(f"layers_{len(self.spec.hidden)}"))
        if "log_std" in weights:
            log_std = weights["log_std"].expand_as(mean)
        else:
            log_std = nn.functional.linear(x, *self._layer("log_std")).clamp(*BOUNDS)
        low, high = weights["action_low"], weights["action_high"]
        if self.spec.distribution == "gaussian":
            return densities.clipped(batch.action, mean, log_std, low, high)
        half = (high - low) / 2
        return densities.squashed((batch.action - (low + high) / 2) / half, mean, log_std, half)

    def _layer(self, name: str) -> tuple[Tensor, Tensor]:
        return self.get_buffer(f"{name}_weight"), self.get_buffer(f"{name}_bias")
