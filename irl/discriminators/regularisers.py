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
