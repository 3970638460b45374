"""The rewards that were written by hand, and the terms they are the sum of.

    reward = sum of terms                                        in every task of `irl.envs.tasks`
    rest   = reward - sum of the others                          the one term that a step alone does not tell

A live environment tells its terms in `info`. A dataset without infos still holds all but one of them: costs
are functions of the action and of the next observation, survival is the absence of a termination, and what is
left of the reward is the last (`irl.rewards.from_steps`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from torch import Tensor

from irl.core.errors import UserError
from irl.core.types import Episode, Transitions
from irl.envs.names import split_name
from irl.envs.tasks import Task, task_of
from irl.rewards.from_steps import NO_MATTER, RULES, Weights


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


def terms_of_info(env_id: str, info: Mapping[str, Any]) -> dict[str, float]:
    """The terms of one step of a live environment, by name; they add up to its reward.

    Raises:
        UserError: the task is not in the table, or `info` lacks a key of its row.
    """
    task = _task(env_id)
    if missing := [key for key in task.terms if key not in info]:
        raise UserError(f"the info of {env_id} lacks {', '.join(missing)}; expected that of a step of it")
    return {name: float(info[key]) for key, name in task.terms.items()} | dict(task.constants)


def with_terms(episode: Episode, env_id: str) -> Episode:
    """The episode with the terms of its rewards, worked out of (action, next_obs, reward, terminated).

    They are what the environment's own infos say, to rounding (1e-12), for data of this version of the task
    with unnormalised observations in float64; in float32 data the terms that observations tell have seven
    digits. They always add up to the reward.

    Args:
        env_id: full name of the task (`irl.envs.names`): weights that it gives are used.

    Raises:
        UserError: the task is not in the table, is given what changes how terms are made, or the episode's
            shapes, rewards or velocities do not tell.
    """
    task = _task(env_id)
    rule, weights, steps = RULES[task.env_id], _weights(env_id), len(episode)
    if episode.obs.shape[1] != rule.obs_size or not np.isfinite(episode.reward).all():
        raise UserError(
            f"an episode with observations of {episode.obs.shape[1]} and a return of {episode.return_:g} "
            f"does not tell the terms of {task.env_id}; expected observations of {rule.obs_size}, and rewards"
        )
    constants = {name: np.full(steps, value) for name, value in task.constants.items()}
    known = rule.others(episode, weights) | constants
    left = episode.reward - sum(known.values(), np.zeros(steps))
    found = known | {rule.rest: left}
    return replace(episode, terms={name: found[name] for name in (*task.terms.values(), *task.constants)})


def _task(env_id: str) -> Task:
    task = task_of(env_id)
    if task is None:
        known = ", ".join(RULES)
        raise UserError(f"the terms of {env_id!r:.80} are not known; those of {known} are")
    return task


def _weights(env_id: str) -> Weights:
    """The weights of the task with those that its full name gives.

    Raises:
        UserError: it gives something else that changes the terms.
    """
    bare, given = split_name(env_id)
    own = RULES[bare].weights
    if unknown := sorted(given.keys() - own.keys() - NO_MATTER):
        raise UserError(
            f"with {', '.join(unknown)} the terms of {bare} cannot be told from its steps; record them, as "
            f"irl demos generate does"
        )
    return {**own, **{name: float(value) for name, value in given.items() if name in own}}
