"""The policy's side of a discriminator's data: the newest rollouts, and a sample of all before them.

A step that leaves the newest draws a key k ~ U(0, 1), and the `memory` steps of the lowest keys stay: at any
time a uniform sample without replacement of all that have left (bottom-k sampling).
"""

from typing import Any

import torch

from irl.core.types import Transitions, concatenate
from irl.envs.absorbing import absorb

COLUMNS = ("obs", "action", "next_obs", "terminated", "truncated")
FLAGS = ("absorbing", "next_absorbing")


class Negatives:
    """The steps of the last `rollouts` rollouts, and up to `memory` of those before.

    Source: Fu et al. (2018), arXiv:1710.11248, whose discriminator is shown those of the previous 20.
    """

    def __init__(
        self, rollouts: int, rng: torch.Generator, *, memory: int = 0, absorbing: bool = False
    ) -> None:
        """`rng` draws what stays in memory; its state is its owner's to keep.

        With `absorbing`, terminations lead into the absorbing state (`irl.envs.absorbing`).
        """
        self._rollouts, self._memory, self._absorbing = rollouts, memory, absorbing
        self._before: list[Transitions] = []
        self._older: Transitions | None = None
        self._keys = torch.empty(0, device=rng.device)
        self._rng = rng

    def with_newest(self, rollout: Transitions) -> Transitions:
        """The steps remembered, of the rollouts kept and of this one; it is kept, the oldest is let go."""
        newest = absorb(rollout) if self._absorbing else rollout
        # without the environment's reward, which no discriminator reads
        kept = Transitions(**{name: getattr(newest, name) for name in (*COLUMNS, *FLAGS)})
        rollouts = [*self._before, kept]
        shown = concatenate(rollouts if self._older is None else [self._older, *rollouts])
        if len(rollouts) == self._rollouts:
            self._remember(rollouts.pop(0))
        self._before = rollouts
        return shown

    def _remember(self, left: Transitions) -> None:
        if not self._memory:
            return
        keys = torch.rand(len(left), generator=self._rng, device=self._rng.device)
        self._keys = torch.cat([self._keys, keys])
        self._older = left if self._older is None else concatenate([self._older, left])
        if len(self._keys) > self._memory:
            # in the order they came: topk alone orders them by key
            stay = self._keys.topk(self._memory, largest=False).indices.sort().values
            self._keys, self._older = self._keys[stay], self._older[stay]

    def state_dict(self) -> dict[str, Any]:
        """The rollouts kept, oldest first, and the memory."""
        older = [] if self._older is None else [_columns(self._older)]
        return {
            "before": [_columns(rollout) for rollout in self._before],
            "older": older,
            "keys": self._keys,
        }

    def load_state_dict(self, state: dict[str, Any], device: torch.device) -> None:
        """Keep what another one of the same settings did."""
        self._before = [Transitions(**rollout).to(device) for rollout in state["before"]]
        older = [Transitions(**of).to(device) for of in state["older"]]
        self._older = older[0] if older else None
        self._keys = state["keys"].to(device)


def _columns(of: Transitions) -> dict[str, Any]:
    return {name: getattr(of, name) for name in (*COLUMNS, *FLAGS)}
