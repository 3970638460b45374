"""What a discriminator minimises: pure functions of logits, D = sigmoid(logit), expert = label 1."""

import torch
import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor


def bce(
    expert: Float[Tensor, "B"],
    policy: Float[Tensor, "C"],
    expert_weight: Float[Tensor, "B"] | None = None,
    policy_weight: Float[Tensor, "C"] | None = None,
) -> Float[Tensor, ""]:
    """-E_expert[log D] - E_policy[log(1 - D)]: log 4 for a blind D, 0 for a perfect one.

    A row of weight w counts as w rows: each mean is sum(w loss) / sum(w).

    Source: Ho & Ermon (2016), arXiv:1606.03476, equation 17, with the labels exchanged.
    """
    return _mean(F.softplus(-expert), expert_weight) + _mean(F.softplus(policy), policy_weight)


def entropy_bonus(logits: Float[Tensor, "B"]) -> Float[Tensor, ""]:
    """E[-D log D - (1 - D) log(1 - D)] = E[softplus(h) - h D]: log 2 for a blind D, 0 for a sure one.

    Subtracted from the loss with a coefficient, it keeps D from being sure.

    Source: Orsini et al. (2021), arXiv:2106.00672, which takes it from the code of Ho & Ermon.
    """
    return (F.softplus(logits) - logits * torch.sigmoid(logits)).mean()


def _mean(loss: Float[Tensor, "B"], weight: Float[Tensor, "B"] | None) -> Float[Tensor, ""]:
    return loss.mean() if weight is None else (weight * loss).sum() / weight.sum()
