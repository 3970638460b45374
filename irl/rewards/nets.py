"""The network behind a learned reward: a logit of (s, a).

x = [normalise(s), a],  logit = mlp(x)
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.nets import Normaliser, mlp
from irl.core.types import Transitions


@dataclass(frozen=True)
class LogitSpec:
    """The shape of a logit network."""

    obs_dim: int
    action_dim: int
    hidden: tuple[int, ...] = (100, 100)
    activation: str = "tanh"


class LogitNet(nn.Module):
    """logit(s, a): high where the expert is likelier than the policy."""

    def __init__(self, spec: LogitSpec, normaliser: Normaliser, generator: torch.Generator) -> None:
        super().__init__()
        self.spec = spec
        self.normaliser = normaliser
        sizes = (spec.obs_dim + spec.action_dim, *spec.hidden, 1)
        self.body = mlp(sizes, spec.activation, generator)

    def inputs(self, batch: Transitions) -> Float[Tensor, "B I"]:
        """What the perceptron sees: normalised observations beside actions in environment units."""
        return torch.cat([self.normaliser(batch.obs), batch.action], dim=1)

    def of_inputs(self, inputs: Float[Tensor, "B I"]) -> Float[Tensor, "B"]:
        """The logit of `inputs(batch)`; the gradient penalty needs this half alone."""
        return self.body(inputs).squeeze(1)

    def forward(self, batch: Transitions) -> Float[Tensor, "B"]:
        return self.of_inputs(self.inputs(batch))
