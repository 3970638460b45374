"""The policy's side of a discriminator's data: the newest rollout, and those before it."""

from typing import Any

import torch

from irl.core.types import Transitions, concatenate
from irl.envs.absorbing import absorb

COLUMNS = ("obs", "action", "next_obs", "terminated", "truncated")
FLAGS = ("absorbing", "next_absorbing")


class Negatives:
    """The steps of the last `rollouts` rollouts.

    Source: Fu et al. (2018), arXiv:1710.11248, whose discriminator is shown those of the previous 20.
    """

    def __init__(self, rollouts: int, absorbing: bool = False) -> None:
        """With `absorbing`, terminations lead into the absorbing state (`irl.envs.absorbing`)."""
        self._rollouts, self._absorbing = rollouts, absorbing
        self._before: list[Transitions] = []

    def with_newest(self, rollout: Transitions) -> Transitions:
        """The steps of this rollout and of those kept, oldest first; it is kept, the oldest is let go."""
        newest = absorb(rollout) if self._absorbing else rollout
        # without the environment's reward, which no discriminator reads
        kept = Transitions(**{name: getattr(newest, name) for name in (*COLUMNS, *FLAGS)})
        shown = [*self._before, kept]
        self._before = shown[-(self._rollouts - 1) :] if self._rollouts > 1 else []
        return concatenate(shown)

    def state_dict(self) -> list[dict[str, Any]]:
        """The rollouts kept, oldest first."""
        names = (*COLUMNS, *FLAGS)
        return [{name: getattr(rollout, name) for name in names} for rollout in self._before]

    def load_state_dict(self, state: list[dict[str, Any]], device: torch.device) -> None:
        """Keep what another one of the same settings did."""
        self._before = [Transitions(**rollout).to(device) for rollout in state]
