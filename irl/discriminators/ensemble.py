"""Several discriminators of one kind, each from first weights of its own, as one.

    logit = mean_k logit_k,   r = mean_k r_k   or   min_k r_k (pessimistic)

All are shown the same batches; what makes them differ is where they start and where each takes its slopes.
The lowest is to a reward what the lowest of two critics is to a value: where the members disagree, which is
where no data were, it pays little.
"""

from collections.abc import Callable, Sequence
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.types import Metrics, Transitions
from irl.discriminators.airl import AIRL
from irl.discriminators.gail import GAIL
from irl.discriminators.switches import SwitchesConfig
from irl.rewards.ensemble import EnsembleNet, combined


def one_or_several(config: SwitchesConfig, make: Callable[[str], GAIL | AIRL]) -> "GAIL | AIRL | Ensemble":
    """What the settings ask for; `make` is given what sets each member's streams apart, first nothing."""
    members = [make(f" {k}" if k else "") for k in range(config.ensemble)]
    return members[0] if len(members) == 1 else Ensemble(members, config.ensemble_reward)


class Ensemble:
    """What a discriminator is, made of several."""

    def __init__(self, members: Sequence[GAIL | AIRL], pays: str) -> None:
        """`pays` is `mean` or `lowest`."""
        self.members, self.pays = list(members), pays
        self.config, self.gamma, self.reward_map = members[0].config, members[0].gamma, members[0].reward_map
        self.net = EnsembleNet.around([member.net for member in members], pays)

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The mean: high where the expert is likelier."""
        return torch.stack([member.logits(batch) for member in self.members]).mean(0)

    def reward(self, batch: Transitions) -> Float[Tensor, "B"]:
        """What the learner is paid, without a gradient."""
        return combined([member.reward(batch) for member in self.members], self.pays)

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        """One gradient step of each. Returns the means of what they say."""
        said = [member.update(expert, policy) for member in self.members]
        return {name: sum(of_one[name] for of_one in said) / len(said) for name in said[0]}

    def anneal(self, remaining: float) -> None:
        """Said before each round: which share of the run remains."""
        for member in self.members:
            member.anneal(remaining)

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on; `net` is where a weight that is not finite is looked for."""
        return {"net": self.net.state_dict(), "members": [member.state_dict() for member in self.members]}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another one of the same settings was."""
        for member, its in zip(self.members, state["members"], strict=True):
            member.load_state_dict(its)
