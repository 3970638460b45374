"""What off-policy learning remembers: transitions, each observation once, no reward of the learner's.

Row t N + i is step t of environment i, so the next observation of a row is the observation N rows
further on. Only where an episode ended is it somewhere else, in a side table. The oldest N rows of a
full memory are those whose observation the newest step has just overwritten; they are not drawn.
"""

from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from irl.core.log import Columns, Log
from irl.core.types import Transitions


class Replay:
    """The last `capacity` transitions of N environments, float32, on the CPU or a device."""

    def __init__(
        self, capacity: int, n_envs: int, obs_size: int, action_size: int, device: str = "cpu"
    ) -> None:
        self.n_envs, self.device = n_envs, device
        self._rows = (-(-capacity // n_envs) + 1) * n_envs
        make = {"dtype": torch.float32, "device": device}
        self._obs = torch.zeros(self._rows, obs_size, **make)
        self._action = torch.zeros(self._rows, action_size, **make)
        self._own = torch.zeros(self._rows, **make)
        self._terminated = torch.zeros(self._rows, dtype=torch.bool, device=device)
        self._truncated = torch.zeros(self._rows, dtype=torch.bool, device=device)
        self._end_of = torch.full((self._rows,), -1, dtype=torch.int32, device=device)
        self._ends = torch.zeros(16, obs_size, **make)
        self._free = list(range(16))
        self._terminations = 0
        self.added = 0
        """Transitions added since the start."""

    def __len__(self) -> int:
        return min(self.added, self._rows - self.n_envs)

    def add(
        self,
        obs: Float[np.ndarray, "N O"],
        action: Float[np.ndarray, "N A"],
        next_obs: Float[np.ndarray, "N O"],
        terminated: Bool[np.ndarray, "N"],
        truncated: Bool[np.ndarray, "N"],
        own: Float[np.ndarray, "N"],
    ) -> None:
        """Remember one step of every environment; `own` is the environments' own reward."""
        here = self.added % self._rows
        now, after = slice(here, here + self.n_envs), (here + self.n_envs) % self._rows
        self._forget_ends(here)
        if self.added >= self._rows - self.n_envs:
            # the oldest rows lose their observation to the newest step below
            self._terminations -= int(self._terminated[after : after + self.n_envs].sum())
        self._terminations += int(terminated.sum())
        self._obs[now], self._action[now] = torch.from_numpy(obs), torch.from_numpy(action)
        self._own[now] = torch.from_numpy(own)
        self._terminated[now] = torch.from_numpy(terminated)
        self._truncated[now] = torch.from_numpy(truncated)
        self._obs[after : after + self.n_envs] = torch.from_numpy(next_obs)
        for i in np.flatnonzero(terminated | truncated).tolist():
            self._end_of[here + i] = slot = self._new_slot()
            self._ends[slot] = torch.from_numpy(next_obs[i])
        self.added += self.n_envs

    def sample(self, size: int, rng: torch.Generator) -> Transitions:
        """`size` transitions drawn with replacement from `rng`."""
        return self.rows(self._places(torch.randint(len(self), (size,), generator=rng, device=self.device)))

    def sample_absorbing(self, size: int, rng: torch.Generator) -> Transitions:
        """`size` transitions of what `irl.envs.absorbing.absorb` makes of the memory.

        Nothing more is stored for it: the steps s_abs -> s_abs are all alike, one for each termination.
        """
        stored = len(self)
        drawn = torch.randint(stored + self._terminations, (size,), generator=rng, device=self.device)
        loop = drawn >= stored
        batch = self.rows(self._places(drawn.clamp(max=stored - 1)))
        into = batch.terminated | loop
        column = loop.unsqueeze(1)
        return Transitions(
            batch.obs.masked_fill_(column, 0.0),
            batch.action.masked_fill_(column, 0.0),
            batch.next_obs.masked_fill_(into.unsqueeze(1), 0.0),
            torch.zeros_like(loop),
            batch.truncated & ~loop,
            None if batch.reward is None else batch.reward.masked_fill_(loop, 0.0),
            absorbing=loop,
            next_absorbing=into,
        )

    def _places(self, drawn: Tensor) -> Tensor:
        """Rows of the oldest transition, the one after it, and so on."""
        return (drawn + (self.added - len(self))) % self._rows

    def rows(self, rows: Tensor) -> Transitions:
        """The transitions stored in these rows."""
        next_obs = self._obs[(rows + self.n_envs) % self._rows]
        slots = self._end_of[rows]
        ended = slots >= 0
        if ended.any():
            next_obs[ended] = self._ends[slots[ended].long()]
        return Transitions(
            self._obs[rows],
            self._action[rows],
            next_obs,
            self._terminated[rows],
            self._truncated[rows],
            self._own[rows],
        )

    def _forget_ends(self, here: int) -> None:
        if self.added >= self._rows:
            old = self._end_of[here : here + self.n_envs]
            self._free += old[old >= 0].tolist()
            old.fill_(-1)

    def _new_slot(self) -> int:
        if not self._free:
            size = len(self._ends)
            self._ends = torch.cat([self._ends, torch.zeros_like(self._ends)])
            self._free = list(range(size, 2 * size))
        return self._free.pop()

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on; the transitions as a log, of which a checkpoint writes the new ones."""
        head = self._newest()
        return {
            "log": Log("replay", self.added - len(self), self.added, self._columns),
            "newest": self._obs[head].cpu(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another memory of the same size was."""
        rows = state["log"]
        for first, columns in rows.pieces:
            self._restore(first, columns, max(rows.start - first, 0))
        self.added = rows.stop
        here = torch.arange(len(self), device=self.device)
        self._terminations = int(self._terminated[self._places(here)].sum())
        self._obs[self._newest()] = state["newest"].to(self.device)

    def _newest(self) -> slice:
        """Where the observations after the newest step are."""
        head = self.added % self._rows
        return slice(head, head + self.n_envs)

    def _columns(self, start: int, stop: int) -> Columns:
        rows = torch.arange(start, stop, device=self.device) % self._rows
        columns = {name: getattr(self, f"_{name}")[rows] for name in _COLUMNS}
        slots = self._end_of[rows]
        columns["ends"] = self._ends[slots[slots >= 0].long()]
        return {name: column.cpu() for name, column in columns.items()}

    def _restore(self, first: int, columns: Columns, skipped: int) -> None:
        ended = columns["terminated"] | columns["truncated"]
        ends = columns["ends"][int(ended[:skipped].sum()) :]
        rows = torch.arange(first + skipped, first + len(ended), device=self.device) % self._rows
        for name in _COLUMNS:
            getattr(self, f"_{name}")[rows] = columns[name][skipped:].to(self.device)
        for row, end in zip(rows[ended[skipped:].to(self.device)].tolist(), ends, strict=True):
            self._end_of[row] = slot = self._new_slot()
            self._ends[slot] = end.to(self.device)


_COLUMNS = ("obs", "action", "own", "terminated", "truncated")
