"""What off-policy networks see: observations normalised, actions within [-1, 1], a flag for s_abs."""

import torch
from gymnasium.spaces import Box
from jaxtyping import Bool, Float
from torch import Tensor

from irl.core.nets import Normaliser


class Inputs:
    """From environment units to networks' and back; the normaliser's moments are read once."""

    def __init__(self, normaliser: Normaliser, box: Box, absorbing_scale: float) -> None:
        """`box` are the actions.

        With `absorbing_scale` the networks take one number more than an observation has: that, in the
        absorbing state, else 0.
        """
        self._scale, device = absorbing_scale, normaliser.mean.device
        self._mean, self._std, self._clip = normaliser.mean, normaliser.std, normaliser.clip
        self._center = torch.as_tensor((box.high + box.low) / 2, device=device)
        self._half = torch.as_tensor((box.high - box.low) / 2, device=device)

    def features(
        self, obs: Float[Tensor, "B O"], absorbing: Bool[Tensor, "B"] | None = None
    ) -> Float[Tensor, "B F"]:
        """Normalised observations, zeros in s_abs, and its indicator."""
        normal = ((obs - self._mean) / self._std).clamp_(-self._clip, self._clip)
        if not self._scale:
            return normal
        if absorbing is None:
            return torch.cat([normal, normal.new_zeros(len(obs), 1)], 1)
        flag = absorbing.unsqueeze(1)
        return torch.cat([normal.masked_fill_(flag, 0.0), self._scale * flag.to(normal.dtype)], 1)

    def scaled(self, action: Float[Tensor, "B A"]) -> Float[Tensor, "B A"]:
        """Environment units to [-1, 1]."""
        return (action - self._center) / self._half

    def unscaled(self, action: Float[Tensor, "B A"]) -> Float[Tensor, "B A"]:
        """[-1, 1] to environment units."""
        return action * self._half + self._center

    def followed(
        self, action: Float[Tensor, "B A"], alive: Float[Tensor, "B"] | None
    ) -> Float[Tensor, "B A"]:
        """The next actions that a target counts: that of s_abs is 0, in environment units.

        `alive` is of where a step leads, not of where it starts.
        """
        if alive is None:
            return action
        return torch.where(alive.unsqueeze(1) > 0, action, self.scaled(torch.zeros_like(action)))


def acting(absorbing: Bool[Tensor, "B"] | None) -> Float[Tensor, "B"] | None:
    """1 where somebody acts; None where it is everywhere."""
    return None if absorbing is None else (~absorbing).float()
