"""The reward that was written by hand, as a `RewardFn`."""

from collections.abc import Mapping
from dataclasses import dataclass

from jaxtyping import Float
from torch import Tensor

from irl.core.types import Transitions


@dataclass(frozen=True)
class HandWritten:
    """The environment's own reward, read from the batch.

    It is not computed, because it is not a function of (s, a, s'): MuJoCo's tasks pay for a change of the x
    position, which their observations hide, and clip velocities that the reward does not
    (`irl.envs.tasks` says what each hides). So it is known where it was recorded, and nowhere else.
    """

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The recorded reward.

        Raises:
            ValueError: the batch recorded none.
        """
        if batch.reward is None:
            raise ValueError(f"these {len(batch)} transitions were recorded without the environment's reward")
        return batch.reward

    def terms(self, batch: Transitions) -> Mapping[str, Float[Tensor, "B"]]:
        """The recorded terms, by name; they add up to the reward.

        Raises:
            ValueError: the batch recorded none.
        """
        if not batch.terms:
            raise ValueError(f"these {len(batch)} transitions were recorded without the terms of the reward")
        return batch.terms
