"""Logits where the loss wants them, slopes where the penalty does, in one pass over the network."""

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.flat import linear_layers
from irl.core.perceptron import Perceptron
from irl.discriminators.dropout import Dropped
from irl.rewards.nets import LogitNet


class Slopes:
    """A logit network as its training sees it.

    By hand (`irl.core.perceptron`), or by autograd where layers are spectrally normalised: their weights are
    not what they multiply by. Where units are dropped, `dropped` evaluates it, by autograd too.
    """

    def __init__(
        self, net: LogitNet, dtype: torch.dtype = torch.float32, dropped: Dropped | None = None
    ) -> None:
        """`net` is where it will stay: moving it to another device later cuts the tie."""
        self._net, self._fast, self._dropped = net, None, dropped
        self.trained = list(net.parameters())
        """What an optimiser is given."""
        if not net.spec.spectral_norm and dropped is None:
            self._fast = Perceptron(linear_layers(net.body), net.spec.activation, dtype)
            self.trained = [self._fast.flat]

    def __call__(
        self, x: Float[Tensor, "B I"], sloped: Float[Tensor, "C I"]
    ) -> tuple[Float[Tensor, "B"], Float[Tensor, "C I"]]:
        """The logit of each row of `x`, and its gradient in the input at each row of `sloped`.

        Both can be differentiated by the weights. With spectral norms it moves their vectors one step on.
        """
        if self._fast is not None:
            logits, slopes = self._fast(torch.cat([x, sloped]), len(sloped))
            return logits[: len(x)], slopes
        self._net.iterate()
        if self._dropped is not None:
            values, at_ends = self._dropped(torch.cat([x, sloped]), len(sloped))
            return values[: len(x)], at_ends
        return self._net.of_inputs(x), input_gradient(self._net, sloped)

    def values(self, x: Float[Tensor, "B I"]) -> Float[Tensor, "B"]:
        """The logit of each row, without a gradient; no unit is dropped."""
        with torch.no_grad():
            return self._net.of_inputs(x) if self._fast is None else self._fast.values(x)

    def refresh(self) -> None:
        """Call it after the weights changed."""
        if self._fast is not None:
            self._fast.refresh()


def input_gradient(net: LogitNet, x: Float[Tensor, "C I"]) -> Float[Tensor, "C I"]:
    """grad_x logit(x) by autograd, differentiable by the weights."""
    x = x.detach().requires_grad_(True)
    (gradient,) = torch.autograd.grad(net.of_inputs(x).sum(), x, create_graph=True)
    return gradient
