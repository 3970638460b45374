"""The network behind a learned reward: a logit of (s, a).

x = [normalise(s), a],  logit = mlp(x)

A network that knows the absorbing state s_abs (`absorbing_scale` c > 0) sees one number more:

x = [normalise(s) (1 - z), a, c z],  z = 1 in s_abs, else 0

The indicator is not normalised: where every demonstration lasts to the time limit it is constant, and
its moments would say nothing. c is its distance from the other states; under a gradient penalty, which
bounds what the logit can gain per distance, s_abs must lie far from all of them.
"""

from dataclasses import dataclass
from typing import ClassVar

import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.config import check_at_least
from irl.core.nets import Normaliser, SpectralLinear, mlp
from irl.core.types import Transitions


@dataclass(frozen=True)
class LogitSpec:
    """The shape of a logit network."""

    KIND: ClassVar[str] = "logit"
    obs_dim: int
    action_dim: int
    hidden: tuple[int, ...] = (100, 100)
    activation: str = "tanh"
    absorbing_scale: float = 0.0
    """What the indicator of s_abs is multiplied by; 0: the network knows no s_abs."""
    spectral_norm: bool = False
    """Whether each layer is divided by its largest singular value."""

    def __post_init__(self) -> None:
        check_at_least(self, 0, "absorbing_scale")

    @property
    def inputs(self) -> int:
        """Numbers the perceptron sees."""
        return self.obs_dim + self.action_dim + (self.absorbing_scale > 0)

    @property
    def sizes(self) -> tuple[tuple[int, ...], ...]:
        """Units of each layer of the one perceptron there is."""
        return ((self.inputs, *self.hidden, 1),)


class LogitNet(nn.Module):
    """logit(s, a): high where the expert is likelier than the policy."""

    def __init__(self, spec: LogitSpec, normaliser: Normaliser, generator: torch.Generator) -> None:
        super().__init__()
        self.spec = spec
        self.normaliser = normaliser
        self.body = mlp((spec.inputs, *spec.hidden, 1), spec.activation, generator, spec.spectral_norm)

    def inputs(self, batch: Transitions) -> Float[Tensor, "B I"]:
        """What the perceptron sees: normalised observations, actions in environment units, the indicator.

        Raises:
            ValueError: the batch has a step in s_abs, and the network knows none.
        """
        obs, scale, absorbing = self.normaliser(batch.obs), self.spec.absorbing_scale, batch.absorbing
        if not scale:
            if absorbing is not None and bool(absorbing.any()):
                raise ValueError(
                    "the batch has steps in the absorbing state, which this network does not know"
                )
            return torch.cat([obs, batch.action], dim=1)
        if absorbing is None:
            return torch.cat([obs, batch.action, obs.new_zeros(len(obs), 1)], dim=1)
        flag = absorbing.unsqueeze(1)
        return torch.cat([obs.masked_fill(flag, 0.0), batch.action, scale * flag.to(obs.dtype)], dim=1)

    def of_inputs(self, inputs: Float[Tensor, "B I"]) -> Float[Tensor, "B"]:
        """The logit of `inputs(batch)`; the gradient penalty needs this half alone."""
        return self.body(inputs).squeeze(1)

    def forward(self, batch: Transitions) -> Float[Tensor, "B"]:
        return self.of_inputs(self.inputs(batch))

    def of_absorbing(self) -> Float[Tensor, "1"]:
        """The logit of (s_abs, 0).

        Raises:
            ValueError: the network knows no s_abs.
        """
        if not self.spec.absorbing_scale:
            raise ValueError("this network knows no absorbing state")
        x = self.normaliser.mean.new_zeros(1, self.spec.inputs)
        x[:, -1] = self.spec.absorbing_scale
        return self.of_inputs(x)

    def iterate(self) -> None:
        """Let the spectral norms follow the weights; call it once before each gradient step."""
        for layer in self.body:
            if isinstance(layer, SpectralLinear):
                layer.iterate()
