"""What keeps a discriminator smooth: pure functions of a logit function and its inputs."""

from collections.abc import Callable

import torch
from jaxtyping import Float
from torch import Tensor


def gradient_penalty(
    logit: Callable[[Tensor], Tensor],
    expert: Float[Tensor, "B I"],
    policy: Float[Tensor, "B I"],
    rng: torch.Generator,
    center: float = 1.0,
) -> Float[Tensor, ""]:
    """E[(|grad_x logit(x)| - center)^2] at x = e expert + (1 - e) policy, one e ~ U[0, 1] a row.

    Centred at 1 it asks for a slope of 1 between the two; at 0, for none that the loss does not need.
    On the logit, not on D: a sigmoid's gradient vanishes where it matters.

    Source: Gulrajani et al. (2017), arXiv:1704.00028, equation 3; centred at 0, Mescheder et al. (2018),
    arXiv:1801.04406, who take it at the data instead.   Cost: one double backward.
    """
    mix = torch.rand(len(expert), 1, generator=rng, device=rng.device)
    x = (mix * expert + (1.0 - mix) * policy).requires_grad_(True)
    (gradient,) = torch.autograd.grad(logit(x).sum(), x, create_graph=True)
    return (gradient.norm(dim=1) - center).square().mean()
