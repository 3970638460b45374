"""From a discriminator's logit h to a reward, D = sigmoid(h), high = expert.

| map   | r(h)                   | range       | where an episode can end early                        |
|-------|------------------------|-------------|-------------------------------------------------------|
| gail  | -log(1 - D)            | (0, inf)    | the end costs all that was to come: a survival bonus  |
| log_d | log D                  | (-inf, 0)   | the end saves all that was to come: it invites an end |
| logit | log D - log(1 - D) = h | (-inf, inf) | either: negative while D is sure, when an end saves   |
| fairl | -h exp(h)              | (-inf, 1/e] | either: a bonus far from the expert, a fine beside it |

A learned reward of the absorbing state (`irl.envs.absorbing`) says what follows, and takes the bias away.

Source of the last column: the signs; Kostrikov et al. (2019), arXiv:1809.02925, section 4.1.
"""

from collections.abc import Callable

import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor

FAIRL_MOST = 10.0
"""Largest exponent of `fairl`: beyond it the map goes on as a line, -h exp(10)."""


def gail(logit: Float[Tensor, "B"]) -> Float[Tensor, "B"]:
    """-log(1 - D) = softplus(logit) >= 0.

    Never negative, so staying alive always pays: a survival bonus in a task that can end early.
    As softplus it neither overflows nor caps, where log(1 - sigmoid + 1e-8) stops at 18.4.

    Source: Ho & Ermon (2016), arXiv:1606.03476, algorithm 1 (the cost log D there, labels exchanged).
    """
    return F.softplus(logit)


def logit(logit: Float[Tensor, "B"]) -> Float[Tensor, "B"]:
    """The logit itself, log D - log(1 - D): it estimates log p_expert - log p_policy.

    Of either sign, so an end is worth either too.

    Source: Fu et al. (2018), arXiv:1710.11248, algorithm 1, line 6.
    """
    return logit


def log_d(logit: Float[Tensor, "B"]) -> Float[Tensor, "B"]:
    """The log of D, -softplus(-logit) <= 0.

    Never positive, so each step costs: where an episode can end early, ending it early pays.

    Source: Goodfellow et al. (2014), arXiv:1406.2661, section 3 (what the generator maximises instead).
    """
    return -F.softplus(-logit)


def fairl(logit: Float[Tensor, "B"]) -> Float[Tensor, "B"]:
    """-h exp(h): the policy that maximises it minimises KL(expert || policy).

    Not increasing: it peaks at h = -1 with 1/e and is negative where the expert is likelier, because a
    reward in expectation over the policy has to be p_expert / p_policy log(p_policy / p_expert).
    The exponent stops at `FAIRL_MOST`, so a sure discriminator fines 1e5 a step, not infinity.

    Source: Ghasemipour et al. (2019), arXiv:1911.02256 (FAIRL).
    """
    return -logit * logit.clamp(max=FAIRL_MOST).exp()


MAPS: dict[str, Callable[[Tensor], Tensor]] = {"gail": gail, "logit": logit, "log_d": log_d, "fairl": fairl}
"""Every map by the name that a saved reward carries."""
