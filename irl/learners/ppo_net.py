"""One network in float32, values and gradients by hand, for gradient steps that are short.

h_0 = x,   h_i = phi(W_i h_{i-1} + b_i) for i = 1..n-1,   y = W_n h_{n-1} + b_n,   phi = tanh or relu

`irl.learners.stack` does several networks at once, in a choice of number formats. At 64 units and some
hundred rows a step is as long as the calls it makes, and here each product is one call that writes where
its result belongs.
"""

from collections.abc import Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.flat import Tied, views
from irl.core.phi import PHI


class Net(Tied):
    """A network whose weights are those of `layers`, and whose gradients lie side by side."""

    def __init__(self, layers: Sequence[nn.Linear], activation: str, gradient: Float[Tensor, "P"]) -> None:
        """`gradient` is where `differentiate` puts the gradients: weight and bias of each layer in order."""
        parameters = [p for layer in layers for p in (layer.weight, layer.bias)]
        self._weights, self._biases = ([p.detach() for p in parameters[i::2]] for i in (0, 1))
        self._gradients = views(gradient, [p.shape for p in parameters])
        self._phi, self._times_slope = PHI[activation]

    def __call__(self, x: Float[Tensor, "B I"]) -> tuple[Float[Tensor, "B K"], list[Tensor]]:
        """Outputs, and the activations that `differentiate` asks for."""
        activations = [x]
        for weight, bias in zip(self._weights[:-1], self._biases[:-1], strict=True):
            activations.append(self._phi(torch.addmm(bias, activations[-1], weight.t())))
        return torch.addmm(self._biases[-1], activations[-1], self._weights[-1].t()), activations

    def differentiate(self, of_y: Float[Tensor, "B K"], activations: Sequence[Tensor]) -> None:
        """Put the gradient in the weights where it was said to go, given that of the outputs."""
        g = of_y
        for i in range(len(activations) - 1, -1, -1):
            torch.mm(g.t(), activations[i], out=self._gradients[2 * i])
            torch.sum(g, 0, out=self._gradients[2 * i + 1])
            if i:
                g = self._times_slope(g @ self._weights[i], activations[i])
