"""A perceptron's values and input gradients by hand, and the gradient of any loss of the two.

h_0 = x,  h_i = phi(W_i h_{i-1} + b_i),  y = w h_n + b,      phi = tanh or relu

slope:    u_n = w phi'_n,   u_{i-1} = (u_i W_i) phi'_{i-1},   grad_x y = u_1 W_1

A gradient penalty differentiates the slope by the weights. Autograd does that with a graph of the graph;
by hand the rows of all parts of a loss share their products, and those between hidden layers may be in
bfloat16, and with them the gradients of the weights there. What touches inputs or outputs is float32. All
weights lie in one tensor (`irl.core.flat`).
"""

from collections.abc import Sequence
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.flat import Tied, flattened, views
from irl.core.phi import PHI


class Perceptron(Tied):
    """A network of one output whose weights stay those of `layers`."""

    def __init__(
        self, layers: Sequence[nn.Linear], activation: str, dtype: torch.dtype = torch.float32
    ) -> None:
        """`dtype` is the number format of what hidden layers exchange."""
        parameters = [p for layer in layers for p in (layer.weight, layer.bias)]
        self.flat = flattened(parameters).requires_grad_()
        """Every weight and bias; what an optimiser is given."""
        self.dtype = dtype
        self.phi, self.times_slope = PHI[activation]
        self.bends = activation == "tanh"
        shapes = [p.shape for p in parameters]
        self.gradient = torch.zeros_like(self.flat.detach())
        self.gradients = views(self.gradient, shapes)
        full = self.flat.detach()
        self._rounded = full if dtype == torch.float32 else full.to(dtype)
        self._exact = exact = views(full, shapes)
        # where nothing is hidden, the first layer is the last
        self.weights = [*exact[:2], *views(self._rounded, shapes)[2:-2], *exact[2:][-2:]]
        """Weight and bias of each layer, as they are multiplied."""

    def refresh(self) -> None:
        """Round the weights anew; call it after they changed."""
        if self.dtype != torch.float32:
            self._rounded.copy_(self.flat.detach())

    def __call__(self, x: Float[Tensor, "B I"], slopes: int = 0) -> tuple[Tensor, Tensor]:
        """Values of all rows (B,), and gradients in x of the last `slopes` rows (slopes, I).

        Differentiable once, in the weights alone.
        """
        return _Evaluate.apply(x, self.flat, self, slopes)  # pyright: ignore[reportReturnType]

    @torch.no_grad()
    def values(self, x: Float[Tensor, "B I"]) -> Float[Tensor, "B"]:
        """Values alone, without a gradient and unrounded in every `dtype`."""
        for weight, bias in zip(self._exact[:-2:2], self._exact[1:-2:2], strict=True):
            x = self.phi(torch.addmm(bias, x, weight.t()))
        return torch.addmv(self._exact[-1], x, self._exact[-2][0])


class _Evaluate(torch.autograd.Function):
    @staticmethod
    def forward(ctx, x: Tensor, flat: Tensor, net: Perceptron, slopes: int) -> tuple[Tensor, Tensor]:
        hidden, (*_, last, bias) = [x], net.weights
        for i in range(0, len(net.weights) - 2, 2):
            h = torch.addmm(net.weights[i + 1], hidden[-1], net.weights[i].t())
            hidden.append(net.phi(h).to(net.dtype))
        y = torch.addmv(bias, hidden[-1].to(x.dtype), last[0])
        # of layer i: what reaches it from above, and that times its activation's slope
        into, through = [], []
        reaching = last.to(hidden[-1].dtype).repeat(slopes, 1)
        for i in range(len(hidden) - 1, 0, -1):
            into.append(reaching)
            through.append(net.times_slope(reaching, hidden[i][len(x) - slopes :]))
            weight = net.weights[2 * i - 2]
            reaching = through[-1].to(weight.dtype) @ weight
        ctx.net, ctx.slopes = net, slopes
        ctx.save_for_backward(*hidden, *into[::-1], *through[::-1])
        return y, reaching

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, *gradients: Tensor) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        (of_y, of_slope), net, n = gradients, ctx.net, ctx.slopes
        layers, rows = len(net.weights) // 2 - 1, len(of_y)
        hidden, rest = ctx.saved_tensors[: layers + 1], ctx.saved_tensors[layers + 1 :]
        net.gradient.zero_()
        ends = [h[rows - n :] for h in hidden]
        bends = _slope_backward(net, of_slope, ends, rest[:layers], rest[layers:]) if n else []
        net.gradients[-2].add_(of_y @ hidden[-1].to(of_y.dtype))
        torch.sum(of_y, 0, keepdim=True, out=net.gradients[-1])
        g = torch.outer(of_y, net.weights[-2][0]).to(net.dtype)
        for i in range(layers, 0, -1):
            if bends:
                g[rows - n :] += bends[i - 1]
            g = net.times_slope(g, hidden[i])
            net.gradients[2 * i - 2].add_(g.t().to(hidden[i - 1].dtype) @ hidden[i - 1])
            net.gradients[2 * i - 1].copy_(g.sum(0))
            if i > 1:
                g = g @ net.weights[2 * i - 2]
        # a copy: a loss of two evaluations adds what this returned to what it returns next
        return None, net.gradient.clone(), None, None


def _slope_backward(
    net: Perceptron, of_slope: Tensor, hidden: list[Tensor], into: Sequence[Tensor], through: Sequence[Tensor]
) -> list[Tensor]:
    """Put the slope's part into the gradients of weights; return its gradients in h_1 ... h_n."""
    bends = []
    for i, (reaching, u) in enumerate(zip(into, through, strict=True)):
        weight = net.weights[2 * i]
        net.gradients[2 * i].copy_(u.t().to(weight.dtype) @ of_slope)
        of_u = (of_slope @ weight.t()).to(net.dtype)
        if net.bends:
            # phi' = 1 - h^2
            bends.append(of_u * reaching * hidden[i + 1] * -2.0)
        of_slope = net.times_slope(of_u, hidden[i + 1])
    net.gradients[-2].copy_(of_slope.sum(0, keepdim=True))
    return bends
