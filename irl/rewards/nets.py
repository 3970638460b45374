"""The network behind a learned reward: a logit of (s, a).

x = [normalise(s), a],  logit = mlp(x)

A network that knows the absorbing state s_abs (`absorbing_scale` c > 0) sees one number more:

x = [normalise(s) (1 - z), a, c z],  z = 1 in s_abs, else 0

A network of states alone sees [normalise(s)], and one of pairs [normalise(s), normalise(s')], with an
indicator for each state: they learn from demonstrations without actions. One of whole steps sees
[normalise(s), a, normalise(s')].

The indicator is not normalised: where every demonstration lasts to the time limit it is constant, and
its moments would say nothing. c is its distance from the other states; under a gradient penalty, which
bounds what the logit can gain per distance, s_abs must lie far from all of them.
"""

from dataclasses import dataclass
from typing import ClassVar

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from irl.core.config import check_at_least
from irl.core.nets import Normaliser, SpectralLinear, mlp
from irl.core.types import Transitions

SEES = {
    "obs_action": "obs, action",
    "obs": "obs",
    "obs_next_obs": "obs, next obs",
    "obs_action_next_obs": "obs, action, next obs",
}
"""What a network may judge a step by, in words."""


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
    sees: str = "obs_action"
    """What it judges a step by, a key of `SEES`."""

    def __post_init__(self) -> None:
        check_at_least(self, 0, "absorbing_scale")
        if self.sees not in SEES:
            raise ValueError(f"sees must be one of {', '.join(SEES)}, not {self.sees!r:.40}")

    @property
    def inputs(self) -> int:
        """Numbers the perceptron sees."""
        more = ("action" in self.sees) * self.action_dim + ("next_obs" in self.sees) * self.obs_dim
        return self.obs_dim + more + self.indicators

    @property
    def indicators(self) -> int:
        """Indicators of s_abs: one for each state that is seen."""
        return (self.absorbing_scale > 0) * (2 if "next_obs" in self.sees else 1)

    @property
    def sizes(self) -> tuple[tuple[int, ...], ...]:
        """Units of each layer of the one perceptron there is."""
        return ((self.inputs, *self.hidden, 1),)


class LogitNet(nn.Module):
    """logit(s, a), logit(s) or logit(s, s'): high where the expert is likelier than the policy."""

    def __init__(self, spec: LogitSpec, normaliser: Normaliser, generator: torch.Generator) -> None:
        super().__init__()
        self.spec = spec
        self.normaliser = normaliser
        self.body = mlp((spec.inputs, *spec.hidden, 1), spec.activation, generator, spec.spectral_norm)

    def inputs(self, batch: Transitions) -> Float[Tensor, "B I"]:
        """What the perceptron sees: normalised observations, actions in environment units, the indicators.

        Raises:
            ValueError: the batch has a step in s_abs, and the network knows none.
        """
        absorbing = batch.absorbing
        if not self.spec.absorbing_scale and absorbing is not None and bool(absorbing.any()):
            raise ValueError("the batch has steps in the absorbing state, which this network does not know")
        parts, flags = [self._state(batch.obs, absorbing)], [absorbing]
        if "action" in self.spec.sees:
            parts.append(batch.action)
        if "next_obs" in self.spec.sees:
            # a recorded termination leads into s_abs, whether it was put into the data or not
            after = batch.terminated
            flags.append(after if batch.next_absorbing is None else after | batch.next_absorbing)
            parts.append(self._state(batch.next_obs, flags[-1]))
        if self.spec.absorbing_scale:
            parts += [self._indicator(flag, parts[0]) for flag in flags]
        return torch.cat(parts, dim=1)

    def _state(self, obs: Float[Tensor, "B O"], absorbing: Bool[Tensor, "B"] | None) -> Float[Tensor, "B O"]:
        seen = self.normaliser(obs)
        if absorbing is None or not self.spec.absorbing_scale:
            return seen
        return seen.masked_fill(absorbing.unsqueeze(1), 0.0)

    def _indicator(self, absorbing: Bool[Tensor, "B"] | None, like: Tensor) -> Float[Tensor, "B 1"]:
        if absorbing is None:
            return like.new_zeros(len(like), 1)
        return self.spec.absorbing_scale * absorbing.unsqueeze(1).to(like.dtype)

    def of_inputs(self, inputs: Float[Tensor, "B I"]) -> Float[Tensor, "B"]:
        """The logit of `inputs(batch)`; the gradient penalty needs this half alone."""
        return self.body(inputs).squeeze(1)

    def forward(self, batch: Transitions) -> Float[Tensor, "B"]:
        return self.of_inputs(self.inputs(batch))

    def of_absorbing(self) -> Float[Tensor, "1"]:
        """The logit of (s_abs, 0), or (s_abs, s_abs).

        Raises:
            ValueError: the network knows no s_abs.
        """
        if not self.spec.absorbing_scale:
            raise ValueError("this network knows no absorbing state")
        x = self.normaliser.mean.new_zeros(1, self.spec.inputs)
        x[:, -self.spec.indicators :] = self.spec.absorbing_scale
        return self.of_inputs(x)

    def iterate(self) -> None:
        """Let the spectral norms follow the weights; call it once before each gradient step."""
        for layer in self.body:
            if isinstance(layer, SpectralLinear):
                layer.iterate()
