"""The logit of a snapshot: of AIRL's, f less the log density of the snapshot's own policy.

That policy is the exported one, the mean over the last updates, where the discriminator had the policy of the
moment: the logit is theirs up to what lay between.
"""

from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.policies.density import Density
from irl.policies.policy import Policy
from irl.rewards.ensemble import EnsembleSpec
from irl.rewards.learned import LearnedReward
from irl.rewards.nets import LogitSpec
from irl.rewards.shaped import ShapedNet


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A reward and the policy of the same moment."""

    reward: LearnedReward
    policy: Policy

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """High where the expert is likelier than this policy.

        A termination is judged as the discriminator saw it: as a step into s_abs where there is one.
        """
        given, spec = self.reward.logits(batch), self.reward.net.spec
        of_one = spec.of if isinstance(spec, EnsembleSpec) else spec
        if isinstance(of_one, LogitSpec):
            return given
        bound = of_one.log_pi_bound
        return given - Density(self.policy)(batch).clamp(-bound, bound)

    @property
    def parts(self) -> dict[str, "Part"]:
        """What the reward is made of, by name: `logit`, and of a single AIRL's also `f`, `g` and `h`."""
        named = ("logit", "f", "g", "h") if isinstance(self.reward.net, ShapedNet) else ("logit",)
        return {name: Part(self, name) for name in named}

    def normalised_by(self, normaliser: Normaliser) -> "Snapshot":
        """The same networks seeing observations through another normaliser."""
        net = self.reward.net
        kept = {name: value for name, value in net.state_dict().items() if "normaliser." not in name}
        other = type(net)(net.spec, normaliser, torch.Generator())  # pyright: ignore[reportArgumentType]
        other.load_state_dict({**other.state_dict(), **kept})
        return replace(self, reward=LearnedReward(self.reward.spec, other))


@dataclass(frozen=True, eq=False)
class Part:
    """One part of a snapshot's reward, as a `RewardFn`."""

    of: Snapshot
    name: str

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        if self.name == "logit":
            return self.of.logits(batch)
        net = self.of.reward.net
        assert isinstance(net, ShapedNet)
        if self.name == "f":
            return net.f(batch, self.of.reward.spec.gamma)
        return net.g(batch) if self.name == "g" else net.h(batch)
