"""The reward of a logit network, for steps as recorded and for steps with the absorbing state put in.

    r'(s, a) = r(s, a) + [terminated] gamma / (1 - gamma) r(s_abs, 0)

A recorded episode stops at a termination; the sum is what s_abs pays for ever after, so that whoever adds
no absorbing state finds the same return. Steps that went through `irl.envs.absorbing.absorb` go on in s_abs
and are not terminated: nothing is added to them. A network that knows no s_abs adds nothing anywhere.

Source: Kostrikov et al. (2019), arXiv:1809.02925, section 4.2. There the sum is found much less stable to
learn from than s_abs in the data, so DAC learns from the second and the first serves a finished reward.
"""

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.types import Transitions
from irl.rewards.maps import MAPS
from irl.rewards.nets import LogitNet


def reward(net: LogitNet, reward_map: str, batch: Transitions, gamma: float) -> Float[Tensor, "B"]:
    """The mapped logit of each step, with the tail where the task ended.

    Raises:
        ValueError: a tail is needed, and gamma is not below 1.
    """
    return of_logits(net, reward_map, net(batch), batch, gamma)


def of_logits(
    net: LogitNet, reward_map: str, logits: Float[Tensor, "B"], batch: Transitions, gamma: float
) -> Float[Tensor, "B"]:
    """The same, given what the network says of the batch.

    Raises:
        ValueError: a tail is needed, and gamma is not below 1.
    """
    of_steps = MAPS[reward_map](logits)
    if not net.spec.absorbing_scale or not bool(batch.terminated.any()):
        return of_steps
    return added(of_steps, MAPS[reward_map](net.of_absorbing()), batch, gamma)


def added(
    of_steps: Float[Tensor, "B"], of_absorbing: Float[Tensor, "1"], batch: Transitions, gamma: float
) -> Float[Tensor, "B"]:
    """The rewards of steps, and what s_abs pays for ever after where the task ended.

    Raises:
        ValueError: gamma is not below 1.
    """
    if not 0.0 <= gamma < 1.0:
        raise ValueError(f"the absorbing state pays for ever: gamma must be in [0, 1), not {gamma}")
    tail = gamma / (1.0 - gamma) * of_absorbing
    return of_steps + torch.where(batch.terminated, tail, torch.zeros_like(tail))
