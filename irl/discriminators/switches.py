"""Settings that GAIL, DAC and AIRL share, off by default; scripts/benchmarks/SWITCHES.md has the why."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import torch
from torch import Tensor

from irl.core.config import check_at_least


@dataclass(frozen=True, kw_only=True)
class SwitchesConfig:
    """What papers disagree on."""

    ADDED: ClassVar[dict[str, Any]] = {
        "loss": "bce",
        "prior": 0.2,
        "label_smoothing": 0.0,
        "mixup": 0.0,
        "dropout": 0.0,
        "input_dropout": 0.0,
        "weight_decay": 0.0,
        "ensemble": 1,
        "ensemble_reward": "mean",
    }

    loss: Literal["bce", "pu", "wasserstein"] = "bce"
    """`bce`, cross-entropy; `pu`, the policy's steps are unlabelled and may be expert; `wasserstein`, the
    difference of means, with `reward_map` logit and a bound on the slope."""
    prior: float = 0.2
    """Share of the policy's steps that count as the expert's; only with `loss` pu."""
    label_smoothing: float = 0.0
    """The expert's label is 1 less this."""
    mixup: float = 0.0
    """D learns from mixtures of an expert and a policy row, at shares drawn from Beta(this, this); 0: off."""
    dropout: float = 0.0
    """Share of hidden units left out while D learns; slower, because gradients are then autograd's."""
    input_dropout: float = 0.0
    """Share of inputs left out while D learns; the same."""
    weight_decay: float = 0.0
    """Share of each weight, times `lr`, that a step takes off (AdamW)."""
    ensemble: int = 1
    """Networks, each from other first weights."""
    ensemble_reward: Literal["mean", "lowest"] = "mean"
    """What several pay: their mean, or the lowest of them."""

    def __post_init__(self) -> None:
        check_at_least(self, 0, "weight_decay")
        check_at_least(self, 1, "ensemble")
        for name in ("dropout", "input_dropout", "label_smoothing"):
            if not 0.0 <= (value := getattr(self, name)) < 1.0:
                raise ValueError(f"{name} must be in [0, 1), not {value}")
        if not 0.0 <= self.mixup <= 1.0:
            raise ValueError(f"mixup must be in [0, 1], not {self.mixup}")
        if not 0.0 < self.prior < 1.0:
            raise ValueError(f"prior must be between 0 and 1, not {self.prior}")
        if self.mixup and self.label_smoothing:
            raise ValueError("mixup has labels of its own; leave label_smoothing or mixup at 0")
        for name in ("mixup", "label_smoothing"):
            if self.loss != "bce" and getattr(self, name):
                raise ValueError(
                    f"{name} changes the labels of cross-entropy, and loss is {self.loss}; use "
                    f"--discriminator.loss bce, or leave {name} at 0"
                )


def optimiser(config: Any, trained: Sequence[Tensor]) -> torch.optim.Adam:
    """Adam; with weight decay, AdamW (Loshchilov & Hutter 2019, arXiv:1711.05101)."""
    if config.weight_decay:
        return torch.optim.AdamW(trained, lr=config.lr, weight_decay=config.weight_decay, fused=True)
    return torch.optim.Adam(trained, lr=config.lr, fused=True)


def check_critic(reward_map: str, entropy: float, bounded: bool) -> None:
    """Refuse what has no meaning beside the Wasserstein loss, whose h is not the logit of a probability.

    Raises:
        ValueError: says what, and what to type instead.
    """
    if reward_map != "logit":
        raise ValueError(
            f"loss wasserstein has no D to take the log of, and reward_map is {reward_map}; use "
            f"--discriminator.reward-map logit, which pays h itself"
        )
    if entropy:
        raise ValueError(f"loss wasserstein has no D whose entropy counts; leave entropy at 0, not {entropy}")
    if not bounded:
        raise ValueError(
            "loss wasserstein grows without end unless the slope is bounded: use --discriminator."
            "gradient-penalty 10 or --discriminator.spectral-norm"
        )
