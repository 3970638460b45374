"""A network as its training sees it where units are left out at random.

    x -> W_n m_n phi(... phi(W_1 m_0 x + b_1) ...) + b_n,   m_i ~ Bernoulli(1 - p_i) / (1 - p_i)

Every row has masks of its own, those whose slopes are asked for too. Nothing is left out of a reward.

Source: Srivastava et al. (2014), Dropout, Journal of Machine Learning Research 15.
"""

from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.nets import SpectralLinear


class Dropped:
    """Values and input gradients by autograd; what `irl.core.perceptron` gives where nothing is left out."""

    def __init__(self, body: nn.Sequential, hidden: float, inputs: float, rng: torch.Generator) -> None:
        """`hidden` and `inputs` are the shares left out; `rng` draws which."""
        self._body, self._hidden, self._inputs, self._rng = body, hidden, inputs, rng
        self.trained = list(body.parameters())
        """What an optimiser is given."""

    def __call__(
        self, x: Float[Tensor, "B I"], slopes: int = 0
    ) -> tuple[Float[Tensor, "B"], Float[Tensor, "S I"]]:
        """Values of all rows, and gradients in x of the last `slopes` rows; differentiable by the weights."""
        x = x.detach().requires_grad_(slopes > 0)
        values = self._through(x).squeeze(1)
        if not slopes:
            return values, x[:0]
        (gradient,) = torch.autograd.grad(values[len(x) - slopes :].sum(), x, create_graph=True)
        return values, gradient[len(x) - slopes :]

    def _through(self, x: Tensor) -> Tensor:
        share = self._inputs
        for layer in self._body:
            if isinstance(layer, nn.Linear | SpectralLinear):
                x, share = self._masked(x, share), self._hidden
            x = layer(x)
        return x

    def _masked(self, x: Tensor, share: float) -> Tensor:
        if share == 0.0:
            return x
        kept = torch.rand(x.shape, generator=self._rng, device=x.device) >= share
        return x * kept / (1.0 - share)


def dropped(config: Any, body: nn.Sequential, rng: torch.Generator) -> Dropped | None:
    """What the settings ask for; None where nothing is left out."""
    if not (config.dropout or config.input_dropout):
        return None
    return Dropped(body, config.dropout, config.input_dropout, rng)
