"""All weights of a network in one tensor: an optimiser's step, a copy or a rounding is one operation."""

from collections.abc import Sequence
from typing import NoReturn

import torch
from jaxtyping import Float
from torch import Tensor, nn


class Tied:
    """What trains the weights of modules that it does not own.

    A copy of both would come apart in silence, because torch copies each parameter by itself: copy the
    modules, and tie the copy.
    """

    def __reduce__(self) -> NoReturn:
        raise TypeError(f"a {type(self).__name__} is tied to its modules' weights and cannot be copied")


def flattened(parameters: Sequence[Tensor]) -> Float[Tensor, "P"]:
    """The parameters' numbers in a row. From now on they are views of it: who changes one changes both."""
    flat = torch.cat([p.detach().reshape(-1) for p in parameters])
    for parameter, view in zip(parameters, views(flat, [p.shape for p in parameters]), strict=True):
        parameter.data = view
    return flat


def views(flat: Float[Tensor, "P"], shapes: Sequence[torch.Size]) -> list[Tensor]:
    """Tensors of these shapes, side by side in `flat`."""
    parts = flat.split([shape.numel() for shape in shapes])
    return [part.view(shape) for part, shape in zip(parts, shapes, strict=True)]


def linear_layers(module: nn.Module) -> list[nn.Linear]:
    """The linear layers of a module, in order."""
    return [m for m in module.modules() if isinstance(m, nn.Linear)]
