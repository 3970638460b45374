"""The mean of the rewards that one run had at several of its snapshots, as one reward.

    r(s, a, s') = 1/K sum_k r_k(s, a, s')

A discriminator answers the policy of its day: the last one tells the expert from policies that nearly are
experts, and what it says of a step that only a beginner takes is what is left of older answers. The mean over
training holds all the answers, each as it was given.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from irl.core.errors import UserError
from irl.rewards.ensemble import EnsembleNet
from irl.rewards.learned import LearnedReward

T = TypeVar("T")


def so_far(snapshots: Mapping[int, T], last: int) -> dict[int, T]:
    """What the mean at step `last` is of: all up to it; step 0, which nothing was learned by, only alone."""
    return {steps: of for steps, of in snapshots.items() if 0 < steps <= last or steps == last}


def averaged(rewards: Sequence[LearnedReward]) -> LearnedReward:
    """A reward that pays the mean of these, and says of itself what the last one does.

    Cost: as many evaluations as there are rewards.

    Args:
        rewards: of one run, the oldest first; the normaliser is that of the first.

    Raises:
        UserError: there is none, they differ in kind, one is an ensemble already, or one has a policy's log
            density in it, of which each snapshot has its own.
    """
    if not rewards:
        raise UserError("the mean of no rewards is none; give one or more")
    nets = [reward.net for reward in rewards if not isinstance(reward.net, EnsembleNet)]
    if len(nets) < len(rewards):
        raise UserError("rewards of ensembles are not averaged; learn with --discriminator.ensemble 1")
    if any(reward.log_pi is not None for reward in rewards):
        raise UserError("f-log-pi has one policy in it and is not averaged; choose g or f")
    kinds = {(r.spec.env_id, r.spec.method, r.spec.reward_map, r.spec.gamma, r.spec.net) for r in rewards}
    if len(kinds) > 1:
        raise UserError(f"rewards of one kind were expected, these are of {len(kinds)}; take one run's")
    net = EnsembleNet.around(nets, "mean")
    return LearnedReward(replace(rewards[-1].spec, net=net.spec), net)
