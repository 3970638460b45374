"""From a discriminator's logit to a reward, D = sigmoid(logit), high = expert."""

import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor


def gail(logit: Float[Tensor, "B"]) -> Float[Tensor, "B"]:
    """-log(1 - D) = softplus(logit) >= 0.

    Never negative, so staying alive always pays: a survival bonus in a task that can end early.
    As softplus it neither overflows nor caps, where log(1 - sigmoid + 1e-8) stops at 18.4.

    Source: Ho & Ermon (2016), arXiv:1606.03476, algorithm 1 (the cost log D there, labels exchanged).
    """
    return F.softplus(logit)


MAPS = {"gail": gail}
"""Every map by the name that a saved reward carries."""
