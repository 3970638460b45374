"""An episode as a dataset holds it, column by column; what cannot have happened is refused."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from gymnasium.spaces import Box, Discrete
from jaxtyping import Float

from irl.core.types import Episode
from irl.envs.discrete import OneHot
from irl.envs.flatten import flat_rows
from irl.envs.tasks import Task, terms_among


@dataclass(frozen=True)
class Columns:
    """What was recorded of one episode: a row of infos may be the reset's, which is then the first."""

    observations: np.ndarray | Mapping[str, np.ndarray]
    actions: np.ndarray
    rewards: np.ndarray
    terminations: np.ndarray
    truncations: np.ndarray
    infos: Mapping[str, np.ndarray]
    seed: int | None = None


@dataclass(frozen=True)
class Layout:
    """What the episodes of a dataset look like."""

    obs_size: int
    actions: Box | Discrete
    task: Task | None = None
    obs_keys: tuple[str, ...] = ()
    """Parts of a dictionary of observations to be put in a row."""


def to_episode(columns: Columns, index: int, layout: Layout) -> Episode:
    """The episode in those columns.

    A step's row of `infos` is what the environment said after the step; the row of the reset is left out.
    Where every term of the layout's task was recorded, they are the episode's terms. A choice of actions
    becomes a row for each. Rewards that are all NaN were not recorded, and stay.

    Raises:
        ValueError: names the episode, and the step and the column where there is one.
    """
    _check_shape(columns.rewards, "rewards", index, (None,))
    steps = len(columns.rewards)
    if steps == 0:
        raise ValueError(f"episode {index} has no steps; expected at least one")
    for name in ("terminations", "truncations"):
        _check_shape(getattr(columns, name), name, index, (steps,))
    terminated, truncated = columns.terminations.astype(bool), columns.truncations.astype(bool)
    ends = np.flatnonzero(terminated | truncated)
    if len(ends) and ends[0] != steps - 1:
        raise ValueError(f"episode {index} ends at step {ends[0]} and goes on to step {steps - 1}")
    infos = _scalars(columns.infos, steps)
    terms = terms_among(layout.task, infos)
    told = layout.task.terms if layout.task is not None and terms else {}
    obs = _row_each(columns.observations, index, layout.obs_keys)
    _check_shape(obs, "observations", index, (steps + 1, layout.obs_size))
    episode = Episode(
        obs=obs.astype(np.float64),
        action=_actions(columns.actions, index, steps, layout.actions),
        reward=columns.rewards.astype(np.float64),
        terminated=bool(terminated[-1]),
        # an episode that nothing ended was cut off by the recording
        truncated=bool(truncated[-1]) or not terminated[-1],
        terms=terms,
        infos={key: values for key, values in infos.items() if key not in told},
        seed=columns.seed,
    )
    unpaid = bool(np.isnan(episode.reward).all())
    check_episode(index, replace(episode, reward=np.zeros(steps)) if unpaid else episode)
    return episode


def check_episode(index: int, episode: Episode) -> None:
    """Refuse observations, actions, rewards or reward terms that are not finite.

    Raises:
        ValueError: names episode, step and column.
    """
    columns = {"observations": episode.obs, "actions": episode.action, "rewards": episode.reward}
    terms = {f"the reward term {name}": values for name, values in episode.terms.items()}
    for name, values in {**columns, **terms}.items():
        finite = np.isfinite(values)
        if not finite.all():
            step, *column = (int(i) for i in np.argwhere(~finite)[0])
            where = f"{name}, column {column[0]}," if column else name
            value = values[step, *column]
            raise ValueError(
                f"episode {index} has {value} in {where} at step {step}; expected finite numbers"
            )


def has_rewards(episodes: Sequence[Episode]) -> bool:
    """Whether the reward of every step was recorded."""
    return all(bool(np.isfinite(episode.reward).all()) for episode in episodes)


def _row_each(
    observations: np.ndarray | Mapping[str, np.ndarray], index: int, keys: tuple[str, ...]
) -> np.ndarray:
    if isinstance(observations, np.ndarray):
        return observations
    parts = [observations[key] for key in keys]
    for key, part in zip(keys, parts, strict=True):
        if part.dtype.kind != "f" or part.ndim < 1 or len(part) != len(parts[0]):
            raise ValueError(
                f"episode {index} has observations {key!r:.40} of {part.dtype} and shape {part.shape}; "
                f"expected a row of real numbers for each of {len(parts[0])}"
            )
    return flat_rows(parts)


def _actions(found: np.ndarray, index: int, steps: int, space: Box | Discrete) -> np.ndarray:
    if isinstance(space, Box):
        _check_shape(found, "actions", index, (steps, space.shape[0]))
        return found
    if found.dtype.kind not in "iu":
        raise ValueError(f"episode {index} has actions of {found.dtype}; expected whole numbers")
    _check_shape(found, "actions", index, (steps,))
    try:
        return OneHot(space).rows(found)
    except ValueError as error:
        raise ValueError(f"episode {index}: {error}") from error


def _check_shape(found: np.ndarray, name: str, index: int, shape: tuple[int | None, ...]) -> None:
    """Refuse a column that is no numbers or of another shape; None in `shape` is any length."""
    if found.dtype.kind not in ("f" if len(shape) > 1 else "fiub"):
        raise ValueError(f"episode {index} has {name} that are not real numbers")
    if len(found.shape) != len(shape) or any(
        wanted not in (None, size) for size, wanted in zip(found.shape, shape, strict=True)
    ):
        wanted = str(shape).replace("None", "any")
        raise ValueError(f"episode {index} has {name} of shape {found.shape}; expected {wanted}")


def _scalars(infos: Mapping[str, np.ndarray], steps: int) -> dict[str, Float[np.ndarray, "T"]]:
    """The infos that are one number a step; some recorders leave out the row of the reset."""
    return {
        key: values[-steps:].astype(np.float64)
        for key, values in infos.items()
        if values.shape in ((steps,), (steps + 1,)) and values.dtype.kind in "biuf"
    }
