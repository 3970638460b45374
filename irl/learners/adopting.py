"""A policy's weights put into a learner, which then acts as it does."""

from collections.abc import Mapping

import torch
from torch import Tensor

from irl.policies.policy import Policy


@torch.no_grad()
def adopt(weights: Mapping[str, Tensor], policy: Policy) -> None:
    """Write a policy's layers and deviations over the learner's `weights`, which have the same names.

    A learner that knows the absorbing state has one input more than the policy; its weights stay.

    Raises:
        ValueError: the policy's layers are of other sizes.
    """
    for name, weight in weights.items():
        given = torch.from_numpy(policy.weights[name]) if name in policy.weights else None
        if given is None or given.ndim != weight.ndim or given.shape[:1] != weight.shape[:1]:
            found = None if given is None else tuple(given.shape)
            raise ValueError(f"{name}: the learner has {tuple(weight.shape)}, the policy {found}")
        into = weight[:, : given.shape[1]] if weight.ndim == 2 else weight
        into.copy_(given)
