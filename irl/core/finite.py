"""Where numbers stopped being numbers."""

from collections.abc import Mapping

import torch
from torch import Tensor


class NotFinite(Exception):
    """A tensor of a training run holds NaN or infinity; the message names it."""


def first_bad(tensors: Mapping[str, Tensor]) -> str | None:
    """Name and content of the first tensor, in order, that is not finite; None when all are.

    >>> first_bad({"w": torch.zeros(2), "b": torch.tensor([0.0, float("nan")])})
    'b (1 of 2 numbers are not finite)'
    """
    for name, tensor in tensors.items():
        # a sum is finite when every number is, unless it overflows: then the numbers are looked at
        if tensor.is_floating_point() and not torch.isfinite(tensor.sum()):
            bad = int((~torch.isfinite(tensor)).sum())
            if bad:
                return f"{name} ({bad:,} of {tensor.numel():,} numbers are not finite)"
    return None


def check_finite(tensors: Mapping[str, Tensor]) -> None:
    """Refuse tensors that are not finite.

    Raises:
        NotFinite: names the first, in order.
    """
    if (bad := first_bad(tensors)) is not None:
        raise NotFinite(bad)


def named(what: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The same tensors with their owner in front of each name."""
    return {f"{what} {name}": tensor for name, tensor in tensors.items()}
