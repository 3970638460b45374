"""How steeply a reward or a logit changes: its gradient in what it sees, the local Lipschitz constant.

    |grad| at a step, in (s / std, a, s' / std):  observations in standard deviations of these steps

Source: Blondé et al. (2020), arXiv:2006.16785, which finds it to decide how stable adversarial imitation is.
"""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float

from irl.core.nets import MIN_STD
from irl.core.types import Transitions
from irl.diagnostics.stack import Given


def steepness(reward: Given, batch: Transitions) -> Float[np.ndarray, "B"]:
    """The norm of the gradient at each step; NaN where the function has none, as a recorded reward.

    Cost: one pass forwards and backwards.
    """
    std = batch.obs.std(0, unbiased=False)
    std = torch.where(std < MIN_STD, torch.ones_like(std), std)
    seen = [x.detach().clone().requires_grad_() for x in (batch.obs, batch.action, batch.next_obs)]
    with torch.enable_grad():
        given = reward(replace(batch, obs=seen[0], action=seen[1], next_obs=seen[2]))
        if not isinstance(given, torch.Tensor) or not given.requires_grad:
            return np.full(len(batch), np.nan)
        # rows are judged one by one, so the gradient of the sum holds each row's own
        gradients = torch.autograd.grad(given.sum(), seen, allow_unused=True)
    squares = [
        (g * scale).double().square().sum(1)
        for g, scale in zip(gradients, (std, 1.0, std), strict=True)
        if g is not None
    ]
    return torch.stack(squares).sum(0).sqrt().numpy()
