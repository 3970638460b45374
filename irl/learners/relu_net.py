"""ReLU networks evaluated by hand: one tensor of weights, one node for autograd, products in bfloat16.

h_0 = x,   h_i = relu(W_i h_{i-1} + b_i) for i = 1..n-1,   y = W_n h_{n-1} + b_n

All weights of a network lie in one flat float32 tensor, and the modules they came from keep views of
it: an optimiser's step, the rounding to bfloat16 and a target's following are one operation each.
Hidden products and activations are in `dtype`; the last layer and all gradients of weights are float32,
so a value of thousands keeps its digits. Where a CPU has bfloat16 instructions, a 256 x 256 x 256
product takes half the time of a float32 one.
"""

from collections.abc import Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn


class ReLUNet:
    """A network whose weights stay those of `body`, and of `heads` side by side as its last layer."""

    def __init__(
        self, body: Sequence[nn.Linear], heads: Sequence[nn.Linear], dtype: torch.dtype = torch.float32
    ) -> None:
        self.dtype = dtype
        parameters = [p for layer in body for p in (layer.weight, layer.bias)]
        parameters += [layer.weight for layer in heads] + [layer.bias for layer in heads]
        self.flat = torch.cat([p.detach().reshape(-1) for p in parameters]).requires_grad_()
        """Every weight and bias; what an optimiser is given."""
        self._shapes = [p.shape for p in parameters[: 2 * len(body)]]
        outputs = sum(layer.out_features for layer in heads)
        self._shapes += [torch.Size((outputs, heads[0].in_features)), torch.Size((outputs,))]
        for parameter, view in zip(
            parameters, _views(self.flat.detach(), [p.shape for p in parameters]), strict=True
        ):
            parameter.data = view
        self._full = _views(self.flat.detach(), self._shapes)
        self.gradient = torch.zeros_like(self.flat.detach())
        self.gradients = _views(self.gradient, self._shapes)
        self._rounded = self.flat.detach() if dtype == torch.float32 else self.flat.detach().to(dtype)
        self.weights = [*_views(self._rounded, self._shapes)[:-2], *self._full[-2:]]
        """Weight and bias of each layer, as they are multiplied."""

    def refresh(self) -> None:
        """Round the weights anew; call it after they changed."""
        if self.dtype != torch.float32:
            self._rounded.copy_(self.flat.detach())

    def __call__(self, x: Float[Tensor, "B I"], frozen: bool = False) -> Float[Tensor, "B K"]:
        """Outputs; differentiable once in `x` and, unless `frozen`, in the weights."""
        return _Evaluate.apply(x, self.flat.detach() if frozen else self.flat, self)  # pyright: ignore[reportReturnType]


class _Evaluate(torch.autograd.Function):
    @staticmethod
    def forward(ctx, x: Tensor, flat: Tensor, net: ReLUNet) -> Tensor:
        h = x.to(net.dtype)
        activations = [h]
        for i in range(0, len(net.weights) - 2, 2):
            h = nn.functional.linear(h, net.weights[i], net.weights[i + 1]).relu_()
            activations.append(h)
        ctx.net = net
        ctx.save_for_backward(*activations)
        return nn.functional.linear(h.float(), *net.weights[-2:])

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, *gradients: Tensor):  # pyright: ignore[reportIncompatibleMethodOverride]
        (g,), net, activations = gradients, ctx.net, ctx.saved_tensors
        needs_x, needs_weights, _ = ctx.needs_input_grad
        if needs_weights:
            torch.mm(g.t(), activations[-1].float(), out=net.gradients[-2])
            torch.sum(g, 0, out=net.gradients[-1])
        g = (g @ net.weights[-2]).to(net.dtype)
        for i in range(len(activations) - 2, -1, -1):
            g = torch.ops.aten.threshold_backward(g, activations[i + 1], 0)
            if needs_weights:
                net.gradients[2 * i].copy_(g.t() @ activations[i])
                net.gradients[2 * i + 1].copy_(g.sum(0))
            if i or needs_x:
                g = g @ net.weights[2 * i]
        return g.float() if needs_x else None, net.gradient if needs_weights else None, None


def linear_layers(module: nn.Module) -> list[nn.Linear]:
    """The linear layers of a module, in order."""
    return [m for m in module.modules() if isinstance(m, nn.Linear)]


def _views(flat: Tensor, shapes: Sequence[torch.Size]) -> list[Tensor]:
    sizes = [shape.numel() for shape in shapes]
    return [part.view(shape) for part, shape in zip(flat.split(sizes), shapes, strict=True)]
