"""A reward that was learned and is learned no more: a function of a batch of transitions."""

import copy
from dataclasses import dataclass, replace
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.types import Transitions
from irl.policies.density import Density
from irl.rewards import tail
from irl.rewards.ensemble import EnsembleNet, EnsembleSpec, combined
from irl.rewards.maps import MAPS
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.shaped import ShapedNet, ShapedSpec


@dataclass(frozen=True)
class RewardSpec:
    """What a saved reward is and where it comes from."""

    env_id: str
    method: str
    reward_map: str
    """Of a logit, a name in `irl.rewards.maps.MAPS`; of g and h, a name in `irl.rewards.shaped.PARTS`."""
    inputs: str
    """What the network sees, in words: `obs, action`."""
    net: LogitSpec | ShapedSpec | EnsembleSpec
    gamma: float
    """The discount of the learner it was learned beside, and of what the absorbing state pays."""
    reward_scale: float
    """What that learner divided it by at this step."""
    env_steps: int
    provenance: dict[str, Any]


class LearnedReward:
    """A frozen reward: call it with a batch of transitions."""

    def __init__(
        self, spec: RewardSpec, net: LogitNet | ShapedNet | EnsembleNet, log_pi: Density | None = None
    ) -> None:
        """`log_pi` is for f - log pi, and nothing else."""
        self.spec, self.net, self.log_pi = spec, net.eval().requires_grad_(False), log_pi
        self._members: list[LearnedReward] = []
        if isinstance(net, EnsembleNet):
            of_one = replace(spec, net=net.spec.of)
            self._members = [LearnedReward(of_one, member, log_pi) for member in net.each]

    def to(self, device: str | torch.device) -> "LearnedReward":
        """A copy there."""
        log_pi = copy.deepcopy(self.log_pi).to(device) if self.log_pi is not None else None
        return LearnedReward(self.spec, copy.deepcopy(self.net).to(device), log_pi)

    def __repr__(self) -> str:
        s = self.spec
        one = s.net.of if isinstance(s.net, EnsembleSpec) else s.net
        of = f"logit({s.inputs})" if isinstance(one, LogitSpec) else s.inputs
        of = f"{s.net.pays} of {s.net.members} {of}" if isinstance(s.net, EnsembleSpec) else of
        return f"LearnedReward({s.method} on {s.env_id}, {s.reward_map}({of}), {s.env_steps} steps)"

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """High where the expert is likelier than the policy of that time.

        Of g and h it is f: AIRL's logit before the log pi of that policy, which is not saved, is taken off.

        Raises:
            ValueError: the batch is of another task.
        """
        self._check(batch)
        if isinstance(self.net, EnsembleNet):
            return combined([member.logits(batch) for member in self._members], "mean")
        return self.net(batch) if isinstance(self.net, LogitNet) else self.net.f(batch, self.spec.gamma)

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The reward of each step; high is good. At a termination, with what the absorbing state pays."""
        self._check(batch)
        if isinstance(self.net, EnsembleNet):
            return combined([member(batch) for member in self._members], self.net.spec.pays)
        if isinstance(self.net, ShapedNet):
            if self.log_pi is None:
                return self.net.paid(self.spec.reward_map, batch, self.spec.gamma)
            return self.net.paid("f", batch, self.spec.gamma) - self._bounded_log_pi(self.log_pi, batch)
        return tail.reward(self.net, self.spec.reward_map, batch, self.spec.gamma)

    def anchored(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The same reward with the absorbing state at 0: what each step pays above what s_abs pays a step.

            r(s, a) - r(s_abs),   and nothing after a termination

        Over any episode, followed by s_abs for ever, it adds up to r's discounted sum less r(s_abs) / (1 -
        gamma), which no policy changes. A reward that knows no s_abs is as it was.
        """
        of_steps, of_absorbing = self.steps_and_absorbing(batch)
        return of_steps if of_absorbing is None else of_steps - of_absorbing

    def steps_and_absorbing(self, batch: Transitions) -> tuple[Float[Tensor, "B"], Float[Tensor, "1"] | None]:
        """What each step pays by itself, and what s_abs pays a step where it is known.

        A step that terminated is the one that the discriminator was shown, into s_abs where it knows one.

        Raises:
            ValueError: the batch is of another task.
        """
        self._check(batch)
        net, pays, gamma = self.net, self.spec.reward_map, self.spec.gamma
        if isinstance(net, EnsembleNet):
            steps, ends = zip(*(m.steps_and_absorbing(batch) for m in self._members), strict=True)
            known = [end for end in ends if end is not None]
            return combined(steps, net.spec.pays), combined(known, net.spec.pays) if known else None
        if isinstance(net, LogitNet):
            return MAPS[pays](net(batch)), MAPS[pays](net.of_absorbing()) if _absorbs(net) else None
        part = "g" if pays == "g" else "f"
        of_steps = net.g(batch) if part == "g" else net.f(batch, gamma)
        if self.log_pi is not None:
            of_steps = of_steps - self._bounded_log_pi(self.log_pi, batch)
        # nobody acts in s_abs, so f - log pi is f there
        return of_steps, net.a_step_in_absorbing(part, gamma) if _absorbs(net) else None

    def _bounded_log_pi(self, log_pi: Density, batch: Transitions) -> Float[Tensor, "B"]:
        assert isinstance(self.spec.net, ShapedSpec)
        bound = self.spec.net.log_pi_bound
        bounded = log_pi(batch).clamp(-bound, bound)
        return bounded if batch.absorbing is None else bounded.masked_fill(batch.absorbing, 0.0)

    def _check(self, batch: Transitions) -> None:
        given, expected = (batch.obs.shape[1], batch.action.shape[1]), self.spec.net
        blind = "action" not in expected.sees
        if given[0] != expected.obs_dim or (given[1] != expected.action_dim and not blind):
            raise ValueError(
                f"the reward of {self.spec.env_id} takes observations of {expected.obs_dim} and actions of "
                f"{expected.action_dim}, the batch has {given[0]} and {given[1]}"
            )


def _absorbs(net: LogitNet | ShapedNet) -> bool:
    return net.spec.absorbing_scale > 0
