"""An exported policy whose weights can be learned, and exported again.

`Policy` acts in numpy; this is the same function in torch, with a gradient. What is trained are its layers
and deviations: moments of observations and bounds of actions stay.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.flat import linear_layers
from irl.core.nets import CLIP, Normaliser, mlp
from irl.core.types import Transitions
from irl.policies.density import log_pi
from irl.policies.policy import Policy, PolicySpec

FIXED = ("obs_mean", "obs_std", "obs_clip", "action_low", "action_high")
"""What no gradient step moves."""


class TrainablePolicy(nn.Module):
    """log pi(a|s) of a batch's own actions, differentiable by the weights of a policy."""

    def __init__(self, policy: Policy, least_log_std: float) -> None:
        """`least_log_std`: a smaller log deviation counts as this one, and is pulled no further down."""
        super().__init__()
        self.spec, self._least = policy.spec, least_log_std
        self._names = list(policy.weights)
        for name, value in policy.weights.items():
            tensor = torch.from_numpy(value.copy())
            if name in FIXED:
                self.register_buffer(_flat(name), tensor)
            else:
                self.register_parameter(_flat(name), nn.Parameter(tensor))

    def forward(self, batch: Transitions) -> Float[Tensor, "B"]:
        """One number a row."""
        return log_pi(self.spec, dict(self._weights()), batch, self._least)

    def export(self) -> Policy:
        """The policy as it is: a copy that later steps leave alone."""
        weights = {name: tensor.detach().cpu().numpy().copy() for name, tensor in self._weights()}
        if "log_std" in weights:
            weights["log_std"] = np.maximum(weights["log_std"], np.float32(self._least))
        return Policy(self.spec, weights)

    def _weights(self) -> Iterator[tuple[str, Tensor]]:
        for name in self._names:
            yield name, getattr(self, _flat(name))


def fresh_policy(
    spec: PolicySpec,
    normaliser: Normaliser,
    bounds: tuple[Float[np.ndarray, "A"], Float[np.ndarray, "A"]],
    log_std: float,
    rng: torch.Generator,
) -> Policy:
    """A policy of random weights drawn from `rng`, with one deviation for all states."""
    net = mlp((spec.obs_dim, *spec.hidden, spec.action_dim), spec.activation, rng)
    weights: dict[str, np.ndarray] = {}
    for i, layer in enumerate(linear_layers(net)):
        weights[f"layers.{i}.weight"] = layer.weight.detach().numpy()
        weights[f"layers.{i}.bias"] = layer.bias.detach().numpy()
    if spec.distribution in ("gaussian", "squashed_gaussian"):
        weights["log_std"] = np.full(spec.action_dim, log_std, dtype=np.float32)
    weights |= {"obs_mean": normaliser.mean.cpu().numpy(), "obs_std": normaliser.std.cpu().numpy()}
    if normaliser.clip != CLIP:
        weights["obs_clip"] = np.float32(normaliser.clip)  # pyright: ignore[reportArgumentType]
    weights |= {"action_low": bounds[0], "action_high": bounds[1]}
    return Policy(spec, weights)


def drawing(policy: Policy, log_std: float = -0.5) -> Policy:
    """The policy, and where it is deterministic the same with a deviation, so that it has a likelihood."""
    if policy.draws:
        return policy
    spec = replace(policy.spec, distribution="squashed_gaussian")
    return Policy(spec, policy.weights | {"log_std": np.full(spec.action_dim, log_std, np.float32)})


def _flat(name: str) -> str:
    return name.replace(".", "_")
