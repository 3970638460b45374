"""Several networks behind one reward: r = mean_k r_k, or the lowest of them."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import torch
from jaxtyping import Float
from torch import Tensor, nn

from irl.core.config import check_at_least
from irl.core.nets import Normaliser
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.shaped import ShapedNet, ShapedSpec

MOST = 1000
"""Members that a file may claim."""


@dataclass(frozen=True)
class EnsembleSpec:
    """How many there are, what each is, and what they pay together."""

    KIND: ClassVar[str] = "ensemble"
    members: int
    pays: Literal["mean", "lowest"]
    of: LogitSpec | ShapedSpec

    def __post_init__(self) -> None:
        check_at_least(self, 1, "members")
        if self.members > MOST:
            raise ValueError(f"members must be at most {MOST}, not {self.members}")

    @property
    def obs_dim(self) -> int:
        """Of each member, as all below."""
        return self.of.obs_dim

    @property
    def action_dim(self) -> int:
        return self.of.action_dim

    @property
    def absorbing_scale(self) -> float:
        return self.of.absorbing_scale

    @property
    def sees(self) -> str:
        return self.of.sees

    @property
    def sizes(self) -> tuple[tuple[int, ...], ...]:
        """Units of each layer of every perceptron."""
        return self.of.sizes * self.members


class EnsembleNet(nn.Module):
    """The members, each with its own copy of the normaliser."""

    def __init__(self, spec: EnsembleSpec, normaliser: Normaliser, generator: torch.Generator) -> None:
        super().__init__()
        self.spec = spec
        kind = LogitNet if isinstance(spec.of, LogitSpec) else ShapedNet
        drawn = [kind(spec.of, copy.deepcopy(normaliser), generator) for _ in range(spec.members)]  # pyright: ignore[reportArgumentType]
        self.members = nn.ModuleList(drawn)

    @classmethod
    def around(cls, nets: Sequence[LogitNet | ShapedNet], pays: str) -> "EnsembleNet":
        """Of networks that are there and go on learning."""
        spec = EnsembleSpec(len(nets), "lowest" if pays == "lowest" else "mean", nets[0].spec)
        made = cls(spec, Normaliser(spec.obs_dim), torch.Generator())
        made.members = nn.ModuleList(nets)
        return made

    @property
    def normaliser(self) -> Normaliser:
        """The first member's; all have the same moments."""
        normaliser = self.members[0].normaliser
        assert isinstance(normaliser, Normaliser)
        return normaliser

    @property
    def each(self) -> list[LogitNet | ShapedNet]:
        """The members."""
        return [net for net in self.members if isinstance(net, LogitNet | ShapedNet)]


def combined(values: Sequence[Float[Tensor, "B"]], pays: str) -> Float[Tensor, "B"]:
    """What members' numbers come to: their `mean`, or the `lowest` of each row."""
    stacked = torch.stack(list(values))
    return stacked.amin(0) if pays == "lowest" else stacked.mean(0)
