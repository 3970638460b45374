"""What a policy's return is compared with."""

from pathlib import Path
from typing import Any

import numpy as np

from irl.demos.load import Demos
from irl.experiment.judge import finite
from irl.policies import shelf
from irl.policies.card import summary

NO_RETURN = "the task's own reward is not a finite number"
NO_REFERENCE = "no expert or random return is known for this task"
NO_SCALE = "the expert's return and that of random actions are equal, so there is no scale between them"


def why_unscored(return_mean: float, random: float | None, expert: float | None) -> str:
    """Why a return that has no normalised score has none."""
    if not np.isfinite(return_mean):
        return NO_RETURN
    return NO_REFERENCE if random is None or expert is None else NO_SCALE


def references_of(env_id: str, demos: Demos, policies_root: Path | None) -> dict[str, Any]:
    """Returns to compare with: from the expert's card, else from the dataset, else unknown."""
    card = shelf.expert_card(env_id, policies_root)
    expert = random = None
    if card is not None:
        source = f"card of {card.env_id} {card.level}"
        std = card.measured.return_std
        expert = {"return_mean": card.measured.return_mean, "return_std": std, "source": source}
        random = {
            "return_mean": card.random_return_mean,
            "return_std": card.random_return_std,
            "source": source,
        }
    else:
        source = f"dataset {demos.dataset_id}"
        if demos.expert_return is not None:
            expert = {"return_mean": demos.expert_return, "return_std": None, "source": source}
        if demos.random_return is not None:
            random = {"return_mean": demos.random_return, "return_std": None, "source": source}
    measured = summary(list(demos.episodes))
    shown = {"return_mean": finite(measured.return_mean), "return_std": finite(measured.return_std)}
    shown |= {"episodes": measured.episodes, "source": f"dataset {demos.dataset_id}"}
    return {"expert": expert, "random": random, "demonstrations": shown}
