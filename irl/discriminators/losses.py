"""What a discriminator minimises: pure functions of logits, D = sigmoid(logit), expert = label 1."""

import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor


def bce(expert: Float[Tensor, "B"], policy: Float[Tensor, "C"]) -> Float[Tensor, ""]:
    """-E_expert[log D] - E_policy[log(1 - D)]: log 4 for a blind D, 0 for a perfect one.

    Source: Ho & Ermon (2016), arXiv:1606.03476, equation 17, with the labels exchanged.
    """
    return F.softplus(-expert).mean() + F.softplus(policy).mean()
