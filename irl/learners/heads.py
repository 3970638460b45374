"""What critics say of the return: one number each, or the atoms of its distribution.

lowest     Q = min_i Q_i,                       L = 1/2 sum_i E[(Q_i - y)^2]
quantiles  Z = the lowest of all critics' atoms, L = E[|tau_k - 1[d < 0]| huber(d)],  d = y_m - z_k

A stack of N critics gives (N, B, K); a target is (M, B): one number a row, or M atoms.

Source: Kuznetsov et al. 2020 (arXiv:2005.04269), TQC; its loss as Stable-Baselines3's contrib has it, a
mean over atoms where the paper has a sum.
"""

from typing import Protocol, runtime_checkable

import torch
from jaxtyping import Float
from torch import Tensor

from irl.learners import sac_gradients as gradients
from irl.learners.sac_losses import critic_loss

Said = Float[Tensor, "N B K"]


@runtime_checkable
class Head(Protocol):
    """How critics' outputs are used."""

    outputs: int

    def ahead(self, said: Said) -> Float[Tensor, "M B"]: ...
    def loss(self, said: Said, target: Float[Tensor, "M B"]) -> Float[Tensor, ""]: ...
    def of_loss(self, said: Said, target: Float[Tensor, "M B"]) -> Said: ...
    def value(self, said: Said) -> Float[Tensor, "B"]: ...
    def of_value(self, said: Said, shares: Float[Tensor, "B"]) -> Said: ...


class Lowest:
    """The lowest of critics of one number: SAC."""

    outputs = 1

    def ahead(self, said: Said) -> Float[Tensor, "M B"]:
        """What a target is made of."""
        return self.value(said).unsqueeze(0)

    def loss(self, said: Said, target: Float[Tensor, "M B"]) -> Float[Tensor, ""]:
        """Squared error."""
        return critic_loss(said.squeeze(2), target.squeeze(0))

    def of_loss(self, said: Said, target: Float[Tensor, "M B"]) -> Said:
        """Its gradient."""
        return gradients.of_critics(said.squeeze(2), target.squeeze(0)).unsqueeze(2)

    def value(self, said: Said) -> Float[Tensor, "B"]:
        """What the actor goes by."""
        return said.squeeze(2).amin(0)

    def of_value(self, said: Said, shares: Float[Tensor, "B"]) -> Said:
        """The gradient of minus its mean, each row by its share."""
        return gradients.of_values(said.squeeze(2), shares).unsqueeze(2)


class Quantiles:
    """Atoms of the return's distribution, without the highest: TQC."""

    def __init__(self, outputs: int, dropped: int) -> None:
        """`outputs` atoms a critic, of which `dropped` count in no target."""
        self.outputs, self.dropped = outputs, dropped

    def ahead(self, said: Said) -> Float[Tensor, "M B"]:
        """All critics' atoms but the highest, in order."""
        n, size, k = said.shape
        atoms = said.transpose(0, 1).reshape(size, n * k).sort(1).values
        return atoms[:, : n * (k - self.dropped)].t()

    def loss(self, said: Said, target: Float[Tensor, "M B"]) -> Float[Tensor, ""]:
        """Quantile regression with Huber's error."""
        difference, k = _differences(said, target), said.shape[2]
        small = difference.abs() <= 1.0
        huber = torch.where(small, 0.5 * difference.square(), difference.abs() - 0.5)
        weight = (_levels(said).view(1, 1, k, 1) - (difference < 0.0).to(said.dtype)).abs()
        return (weight * huber).mean()

    def of_loss(self, said: Said, target: Float[Tensor, "M B"]) -> Said:
        """Its gradient: -(tau sum_m d+ + (1 - tau) sum_m d-), d+ and d- the parts of d held to [-1, 1]."""
        # in place: each pass over N x B x K x M numbers that makes a tensor costs as much as a product
        difference, levels = _differences(said, target).clamp_(-1.0, 1.0), _levels(said)
        both = difference.sum(3)
        above = difference.clamp_(min=0.0).sum(3)
        return (levels * above + (1.0 - levels) * (both - above)) / -difference.numel()

    def value(self, said: Said) -> Float[Tensor, "B"]:
        """The mean of all atoms."""
        return said.mean((0, 2))

    def of_value(self, said: Said, shares: Float[Tensor, "B"]) -> Said:
        """The gradient of minus its mean, each row by its share."""
        n, _, k = said.shape
        return (shares / -(n * k)).view(1, -1, 1).expand_as(said)


def _levels(said: Said) -> Float[Tensor, "K"]:
    k = said.shape[2]
    return (torch.arange(k, device=said.device, dtype=said.dtype) + 0.5) / k


def _differences(said: Said, target: Float[Tensor, "M B"]) -> Float[Tensor, "N B K M"]:
    # atoms lie side by side: sums over a stride take six times as long
    return target.t().contiguous().unsqueeze(1) - said.unsqueeze(3)
