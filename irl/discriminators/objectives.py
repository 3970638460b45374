"""Which rows a discriminator is shown, and what it minimises on their logits, by its settings."""

from collections.abc import Callable

import torch
from jaxtyping import Float
from torch import Tensor

from irl.discriminators import losses, regularisers
from irl.discriminators.switches import SwitchesConfig

Weight = Tensor | None
Loss = Callable[[Tensor], Tensor]


def objective(
    config: SwitchesConfig,
    expert: Float[Tensor, "B I"],
    policy: Float[Tensor, "C I"],
    weights: tuple[Weight, Weight],
    rng: torch.Generator,
) -> tuple[Float[Tensor, "D I"], Loss]:
    """The rows, expert's first, and the loss of their logits; `rng` draws the shares of mixup.

    Raises:
        ValueError: rows are to be mixed, and there are not as many of each.
    """
    if config.mixup:
        if len(expert) != len(policy):
            raise ValueError(
                f"mixup needs as many expert rows as policy rows: {len(expert)} != {len(policy)}"
            )
        share = regularisers.shares(len(expert), config.mixup, rng)
        row = share.unsqueeze(1)
        mixed = row * expert + (1.0 - row) * policy
        return mixed, lambda logits: losses.mixed(logits, share, _mixed(*weights))
    return torch.cat([expert, policy]), lambda logits: of_logits(
        config, logits[: len(expert)], logits[len(expert) :], weights
    )


def of_logits(
    config: SwitchesConfig, expert: Tensor, policy: Tensor, weights: tuple[Weight, Weight]
) -> Float[Tensor, ""]:
    """The loss that the settings name, on the logits of unmixed rows."""
    if config.loss == "pu":
        return losses.positive_unlabelled(expert, policy, config.prior, *weights)
    if config.loss == "wasserstein":
        return losses.wasserstein(expert, policy, *weights)
    if config.label_smoothing:
        return losses.smoothed(expert, policy, config.label_smoothing, *weights)
    return losses.bce(expert, policy, *weights)


def _mixed(expert: Weight, policy: Weight) -> Weight:
    """Of a pair of independent draws: the product, as many times as each row stands for others."""
    if expert is None or policy is None:
        return policy if expert is None else expert
    return expert * policy
