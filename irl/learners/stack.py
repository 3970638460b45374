"""Networks of one shape, side by side: values and gradients by hand, products in bfloat16.

h_0 = x,   h_i = phi(W_i h_{i-1} + b_i) for i = 1..n-1,   y = W_n h_{n-1} + b_n,   phi = tanh or relu

All weights of a stack lie in one flat float32 tensor, and the modules they came from keep views of it: an
optimiser's step, the rounding to bfloat16 and a target's following are one operation each, and so is a
layer of all its networks. Hidden products and activations are in `dtype`, and with them the gradients of
hidden weights; the last layer is float32, so a value of thousands keeps its digits. Where a CPU has
bfloat16 instructions, a 256 x 256 x 256 product takes half the time of a float32 one.

Nothing here is known to autograd: at these sizes its bookkeeping costs as much as the products.
"""

from collections.abc import Iterable, Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.flat import Tied, flattened, linear_layers, views
from irl.core.phi import PHI


class Stack(Tied):
    """N networks whose weights stay those of `bodies`, and of their heads joined as one last layer."""

    def __init__(
        self,
        bodies: Sequence[Sequence[nn.Linear]],
        heads: Sequence[Sequence[nn.Linear]],
        activation: str = "relu",
        dtype: torch.dtype = torch.float32,
    ) -> None:
        """One row of layers for each network, and one row of heads."""
        n, self.dtype, (self.phi, self.times_slope) = len(bodies), dtype, PHI[activation]
        layers = [*zip(*bodies, strict=True), tuple(head for of_one in heads for head in of_one)]
        parameters = [getattr(m, name) for layer in layers for name in ("weight", "bias") for m in layer]
        shapes = [shape for layer in layers for shape in _shapes(layer, n)]
        self.flat = flattened(parameters)
        """Every weight and bias; what an optimiser is given."""
        self.flat.grad = torch.zeros_like(self.flat)
        self._gradients = views(self.flat.grad, shapes)
        self._rounded = self.flat if dtype == torch.float32 else self.flat.to(dtype)
        self._exact = exact = views(self.flat, shapes)
        self.weights = [*views(self._rounded, shapes)[:-2], *exact[-2:]]
        """Weights (N, J, I) and biases (N, 1, J) of each layer, as they are multiplied."""
        self._across = [weight.mT for weight in self.weights[::2]]

    def refresh(self) -> None:
        """Round the weights anew; call it after they changed."""
        if self.dtype != torch.float32:
            self._rounded.copy_(self.flat)

    def __call__(self, x: Float[Tensor, "B I"]) -> tuple[Float[Tensor, "N B K"], list[Tensor]]:
        """Outputs of every network, and the activations that `differentiate` asks for."""
        h = x.to(self.dtype).expand(len(self.weights[0]), -1, -1)
        activations = [h]
        for across, bias in zip(self._across[:-1], self.weights[1:-2:2], strict=True):
            h = self.phi(torch.baddbmm(bias, h, across))
            activations.append(h)
        return torch.baddbmm(self.weights[-1], h.float(), self._across[-1]), activations

    def values(self, x: Float[Tensor, "B I"]) -> Float[Tensor, "N B K"]:
        """Outputs alone, unrounded in every `dtype`: faster for a few rows, and what a saved network says."""
        h = x.expand(len(self._exact[0]), -1, -1)
        for weight, bias in zip(self._exact[:-2:2], self._exact[1:-2:2], strict=True):
            h = self.phi(torch.baddbmm(bias, h, weight.mT))
        return torch.baddbmm(self._exact[-1], h, self._exact[-2].mT)

    def differentiate(self, of_y: Float[Tensor, "N B K"], activations: Sequence[Tensor]) -> None:
        """Put the gradient in the weights into `flat.grad`, given that of the outputs."""
        torch.bmm(of_y.mT, activations[-1].float(), out=self._gradients[-2])
        torch.sum(of_y, 1, keepdim=True, out=self._gradients[-1])
        g = self._below_outputs(of_y)
        for i in range(len(activations) - 2, -1, -1):
            g = self.times_slope(g, activations[i + 1])
            if self.dtype == torch.float32:
                torch.bmm(g.mT, activations[i], out=self._gradients[2 * i])
            else:
                self._gradients[2 * i].copy_(g.mT @ activations[i])
            torch.sum(g, 1, keepdim=True, dtype=torch.float32, out=self._gradients[2 * i + 1])
            if i:
                g = g @ self.weights[2 * i]

    def into_inputs(
        self, of_y: Float[Tensor, "N B K"], activations: Sequence[Tensor]
    ) -> Float[Tensor, "N B I"]:
        """The gradient in x through each network, given that of the outputs."""
        g = self._below_outputs(of_y)
        for i in range(len(activations) - 2, -1, -1):
            g = self.times_slope(g, activations[i + 1]) @ self.weights[2 * i]
        return g.float()

    def _below_outputs(self, of_y: Float[Tensor, "N B K"]) -> Float[Tensor, "N B J"]:
        weight = self.weights[-2]
        # an outer product is no work for a matrix product
        return (of_y * weight if of_y.shape[2] == 1 else of_y @ weight).to(self.dtype)


def stacked(nets: Iterable[nn.Module], dtype: torch.dtype) -> Stack:
    """Whole networks, with ReLU between their layers."""
    layers = [linear_layers(net) for net in nets]
    return Stack([of_one[:-1] for of_one in layers], [of_one[-1:] for of_one in layers], dtype=dtype)


def _shapes(layer: Sequence[nn.Linear], n: int) -> list[torch.Size]:
    outputs = sum(module.out_features for module in layer) // n
    return [torch.Size((n, outputs, layer[0].in_features)), torch.Size((n, 1, outputs))]
