"""How demonstrations were made and which were kept: chosen before, and written into the dataset after."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from irl.core.config import check_at_least
from irl.core.errors import UserError
from irl.core.types import Episode
from irl.envs.behaviour import Behaviour


@dataclass(frozen=True)
class Recording:
    """What a dataset of episodes is to be."""

    seed: int = 0
    """Of the streams that the behaviour draws from."""
    behaviour: Behaviour = field(default_factory=Behaviour)
    subsampling_rate: int = 1
    """Every so-manieth step is meant to be learned from; only noted, every step is kept."""
    min_return: float | None = None
    """Episodes with a smaller return are dropped."""
    full_length: bool = False
    """Episodes that the task ended are dropped: what is kept came to the time limit."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "subsampling_rate")


@dataclass(frozen=True)
class Recorded:
    """What became of it, as the dataset's metadata say."""

    how: Recording
    played: int
    """Episodes, with those that were dropped."""
    dropped_for_return: int
    dropped_for_length: int
    """Of those whose return was large enough."""

    @property
    def words(self) -> str:
        """A line for a person."""
        how, made = self.how, [f"{self.played} episodes"]
        if how.behaviour.stochastic:
            made.append("drawn from the policy's distribution")
        if how.behaviour.noise:
            made.append(f"noise of {how.behaviour.noise:g}")
        if how.behaviour.random:
            made.append(f"{how.behaviour.random:.1%} of actions random")
        if how.min_return is not None:
            made.append(f"{self.dropped_for_return} dropped for a return below {how.min_return:g}")
        if how.full_length:
            made.append(f"{self.dropped_for_length} dropped for ending early")
        if how.subsampling_rate > 1:
            made.append(f"meant to be learned from at rate {how.subsampling_rate}")
        return ", ".join(made)


def together(parts: Sequence[Recorded | None]) -> Recorded | None:
    """What is said of several datasets as one; None where they were not made in the same way."""
    known = [part for part in parts if part is not None]
    if len(known) < len(parts) or any(part.how != known[0].how for part in known):
        return None
    counts = ("played", "dropped_for_return", "dropped_for_length")
    return Recorded(known[0].how, *(sum(getattr(part, name) for part in known) for name in counts))


def keep(episodes: Sequence[Episode], how: Recording) -> tuple[list[int], Recorded]:
    """Places of the episodes that are kept, and what is written down.

    Raises:
        UserError: none is; says what they came to.
    """
    least = how.min_return
    good = [i for i, e in enumerate(episodes) if least is None or e.return_ >= least]
    kept = [i for i in good if not (how.full_length and episodes[i].terminated)]
    recorded = Recorded(how, len(episodes), len(episodes) - len(good), len(good) - len(kept))
    if not kept:
        raise UserError(
            f"none of {len(episodes)} episodes is kept ({recorded.words}): the best return is "
            f"{max(e.return_ for e in episodes):.1f}, the longest {max(map(len, episodes))} steps; nothing "
            f"was written"
        )
    return kept, recorded
