"""Reinforcement learning on a given reward: how an expert is made.

each round:  batch <- learner.collect();  policy <- learner.improve(reward)
"""

from collections.abc import Iterator
from typing import Any

from irl.algorithms.loop import Learner, Round
from irl.core.types import RewardFn


class Forward:
    """A learner and a reward that does not change."""

    def __init__(self, learner: Learner, reward: RewardFn) -> None:
        self.learner, self.reward = learner, reward
        self.index = 0
        learner.start(reward)

    def rounds(self, steps: int) -> Iterator[Round]:
        """Learn until `steps` environment steps are taken; the last round may go past them."""
        while self.learner.env_steps < steps:
            self.learner.collect()
            metrics = self.learner.improve(self.reward)
            self.index += 1
            yield Round(self.index, self.learner.env_steps, metrics)

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        return {"learner": self.learner.state_dict(), "index": self.index}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another run of the same settings was."""
        self.learner.load_state_dict(state["learner"])
        self.index = state["index"]
