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


def smoothed(
    expert: Float[Tensor, "B"],
    policy: Float[Tensor, "C"],
    smoothing: float,
    expert_weight: Float[Tensor, "B"] | None = None,
    policy_weight: Float[Tensor, "C"] | None = None,
) -> Float[Tensor, ""]:
    """The same with 1 - smoothing as the expert's label: D is sure of no expert step.

        -E_expert[(1 - s) log D + s log(1 - D)] - E_policy[log(1 - D)]

    At the optimum D = (1 - s) p_E / (p_E + p).

    Source: Salimans et al. (2016), arXiv:1606.03498, one-sided label smoothing.
    """
    of_expert = (1.0 - smoothing) * F.softplus(-expert) + smoothing * F.softplus(expert)
    return _mean(of_expert, expert_weight) + _mean(F.softplus(policy), policy_weight)


def positive_unlabelled(
    expert: Float[Tensor, "B"],
    policy: Float[Tensor, "C"],
    prior: float,
    expert_weight: Float[Tensor, "B"] | None = None,
    policy_weight: Float[Tensor, "C"] | None = None,
) -> Float[Tensor, ""]:
    """The policy's steps are unlabelled: a share `prior` of them is taken for the expert's.

        prior E_expert[-log D] + max(0, E_policy[-log(1 - D)] - prior E_expert[-log(1 - D)])

    Without the max, at the optimum D = prior p_E / p. With it the risk of the negatives, which cannot be
    below 0, is not learned below it from a finite sample.

    Source: Kiryo et al. (2017), arXiv:1703.00593, the non-negative risk; for imitation Xu & Denil (2019),
    arXiv:1911.00459.
    """
    of_negatives = _mean(F.softplus(policy), policy_weight) - prior * _mean(F.softplus(expert), expert_weight)
    return prior * _mean(F.softplus(-expert), expert_weight) + of_negatives.clamp(min=0.0)


def wasserstein(
    expert: Float[Tensor, "B"],
    policy: Float[Tensor, "C"],
    expert_weight: Float[Tensor, "B"] | None = None,
    policy_weight: Float[Tensor, "C"] | None = None,
) -> Float[Tensor, ""]:
    """E_policy[h] - E_expert[h]: minus the distance of the two, where the slope of h is at most 1.

    Nothing else bounds h: without a penalty or a norm it grows without end. h is no logit; D says nothing.

    Source: Arjovsky et al. (2017), arXiv:1701.07875.
    """
    return _mean(policy, policy_weight) - _mean(expert, expert_weight)


def mixed(
    logits: Float[Tensor, "B"], share: Float[Tensor, "B"], weight: Float[Tensor, "B"] | None = None
) -> Float[Tensor, ""]:
    """Twice -E[share log D + (1 - share) log(1 - D)], of rows that are the expert's by `share`.

    Twice, so that a blind D has log 4, as with `bce`, and a penalty beside it weighs the same.

    Source: Zhang et al. (2018), arXiv:1710.09412.
    """
    return 2.0 * _mean(F.softplus(logits) - share * logits, weight)


def entropy_bonus(logits: Float[Tensor, "B"]) -> Float[Tensor, ""]:
    """E[-D log D - (1 - D) log(1 - D)] = E[softplus(h) - h D]: log 2 for a blind D, 0 for a sure one.

    Subtracted from the loss with a coefficient, it keeps D from being sure.

    Source: Orsini et al. (2021), arXiv:2106.00672, which takes it from the code of Ho & Ermon.
    """
    return (F.softplus(logits) - logits * torch.sigmoid(logits)).mean()


def _mean(loss: Float[Tensor, "B"], weight: Float[Tensor, "B"] | None) -> Float[Tensor, ""]:
    return loss.mean() if weight is None else (weight * loss).sum() / weight.sum()
