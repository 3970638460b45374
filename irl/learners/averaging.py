"""A moving average of weights: steadier than the newest ones.

w' <- c w' + (1 - c) w      with c = min(decay, k / (k + 1)) at the k-th update
"""

from typing import Any

import torch
from torch import Tensor


class WeightAverage:
    """The average of named weights; with decay 0 it is the newest weights."""

    def __init__(self, weights: dict[str, Tensor], decay: float) -> None:
        self.decay = decay
        self.weights = {name: weight.clone() for name, weight in weights.items()}
        self._updates = 0

    @torch.no_grad()
    def update(self, weights: dict[str, Tensor]) -> None:
        """Take in newer weights; the first ones count fully, so the random start is forgotten."""
        kept = min(self.decay, self._updates / (self._updates + 1.0))
        for name, weight in weights.items():
            self.weights[name].mul_(kept).add_(weight, alpha=1.0 - kept)
        self._updates += 1

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on."""
        copies = {name: weight.clone() for name, weight in self.weights.items()}
        return {"weights": copies, "updates": self._updates}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another one was."""
        self.weights = {name: weight.clone() for name, weight in state["weights"].items()}
        self._updates = state["updates"]
