"""Activations for gradients by hand: in place, and their slope told from their value."""

from collections.abc import Callable

import torch
from torch import Tensor


def _of_tanh(g: Tensor, h: Tensor) -> Tensor:
    return torch.ops.aten.tanh_backward(g, h)


def _of_relu(g: Tensor, h: Tensor) -> Tensor:
    return torch.ops.aten.threshold_backward(g, h, 0)


PHI: dict[str, tuple[Callable[[Tensor], Tensor], Callable[[Tensor, Tensor], Tensor]]] = {
    "tanh": (torch.Tensor.tanh_, _of_tanh),
    "relu": (torch.Tensor.relu_, _of_relu),
}
"""By name: h = phi(z) in place, and (g, h) -> g phi'(z)."""
