"""A policy's weights put into a learner, which then acts as it does."""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from irl.policies.policy import Policy


def seeing(hidden: Sequence[object]) -> set[str]:
    """Names of the weights whose inputs are observations, in an actor with these hidden layers."""
    return {"layers.0.weight"} if hidden else {"layers.0.weight", "log_std.weight"}


@torch.no_grad()
def adopt(weights: Mapping[str, Tensor], policy: Policy) -> None:
    """Write a policy's layers and deviations over the learner's `weights`, which have the same names.

    A learner that knows the absorbing state has one input more than the policy; its weights stay.

    Raises:
        ValueError: the policy's layers are of other sizes.
    """
    first = seeing([name for name in weights if name.startswith("layers.1.")])
    for name, weight in weights.items():
        given = torch.from_numpy(policy.weights[name]) if name in policy.weights else torch.zeros(0, 0)
        # the indicator of the absorbing state is the last input
        narrower = weight[:, :-1] if name in first else weight
        into = next((part for part in (weight, narrower) if part.shape == given.shape), None)
        if into is None:
            found = tuple(given.shape) if name in policy.weights else "none"
            raise ValueError(f"{name}: the learner has {tuple(weight.shape)}, the policy {found}")
        into.copy_(given)
