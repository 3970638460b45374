"""What keeps a discriminator smooth: pure functions of inputs and of a logit's slopes there."""

import torch
from jaxtyping import Float
from torch import Tensor


def between(
    expert: Float[Tensor, "B I"], policy: Float[Tensor, "B I"], rng: torch.Generator
) -> Float[Tensor, "B I"]:
    """Where the slope is asked for: x = e expert + (1 - e) policy, one e ~ U[0, 1] a row.

    Source: Gulrajani et al. (2017), arXiv:1704.00028, algorithm 1, line 6.
    """
    mix = torch.rand(len(expert), 1, generator=rng, device=rng.device)
    return mix * expert + (1.0 - mix) * policy


def slope_penalty(slopes: Float[Tensor, "B I"], center: float = 1.0) -> Float[Tensor, ""]:
    """E[(|grad_x logit(x)| - center)^2].

    Centred at 1 it asks for a slope of 1 between expert and policy; at 0, for none that the loss does not
    need. On the logit, not on D: a sigmoid's gradient vanishes where it matters.

    Source: Gulrajani et al. (2017), arXiv:1704.00028, equation 3; centred at 0, Mescheder et al. (2018),
    arXiv:1801.04406, who take it at the data instead.
    """
    return (slopes.norm(dim=1) - center).square().mean()


def shares(n: int, alpha: float, rng: torch.Generator) -> Float[Tensor, "N"]:
    """N draws of Beta(alpha, alpha), alpha in (0, 1]: shares of the expert in a mixture.

        x = u^(1/alpha), y = v^(1/alpha), the first pair with x + y <= 1:   x / (x + y)

    by Johnk's method, in logarithms because a small alpha underflows; torch's own Beta takes no generator. At
    alpha = 1 half of the pairs are accepted, below it more, and none of 50 once in 1e15.

    Source: Zhang et al. (2018), arXiv:1710.09412, who draw the shares of mixup so.
    """
    u = torch.rand(2, 50, n, generator=rng, device=rng.device).clamp_(min=1e-12).log() / alpha
    accepted = torch.logaddexp(u[0], u[1]) <= 0.0
    first = accepted.float().argmax(0, keepdim=True)
    return torch.sigmoid((u[0] - u[1]).gather(0, first)[0])
