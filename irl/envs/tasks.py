"""The MuJoCo tasks: what each pays for, under which `info` keys it says so, and what its observation hides.

In every row the named terms and the constants add up to the environment's reward (they are signed: a cost is
negative).
The keys were read off gymnasium 1.4.0; a test holds each row against the live environment.
"""

import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Task:
    """One MuJoCo task."""

    env_id: str
    name: str
    """Short name, in folders and dataset ids."""
    terms: Mapping[str, str]
    """`info` key -> term name; the terms add up to the reward."""
    infos: tuple[str, ...]
    """Other scalar `info` keys worth recording."""
    hides: str
    """What moves the reward but is not in the observation."""
    constants: Mapping[str, float]
    """Terms that no `info` key tells, the same at every step."""


def _row(env_id: str, terms: tuple[str, ...], infos: tuple[str, ...], hides: str, **constants: float) -> Task:
    named = {key: key.removeprefix("reward_") for key in terms}
    name = env_id.split("-")[0].lower()
    return Task(env_id, name, MappingProxyType(named), infos, hides, MappingProxyType(constants))


_PLANAR = ("x_position", "z_distance_from_origin", "x_velocity")
_SPATIAL = ("x_position", "y_position", "distance_from_origin", "x_velocity", "y_velocity")

TASKS: tuple[Task, ...] = (
    _row(
        "Hopper-v5",
        ("reward_forward", "reward_ctrl", "reward_survive"),
        _PLANAR,
        "the x position: reward_forward is its change over a step, which the velocities only approximate; "
        "velocities beyond +-10",
    ),
    _row(
        "HalfCheetah-v5",
        ("reward_forward", "reward_ctrl"),
        ("x_position", "x_velocity"),
        "the x position: reward_forward is its change over a step, which the velocities only approximate",
    ),
    _row(
        "Walker2d-v5",
        ("reward_forward", "reward_ctrl", "reward_survive"),
        _PLANAR,
        "the x position: reward_forward is its change over a step, which the velocities only approximate; "
        "velocities beyond +-10",
    ),
    _row(
        "Ant-v5",
        ("reward_forward", "reward_ctrl", "reward_contact", "reward_survive"),
        _SPATIAL,
        "the x and y position of the torso: reward_forward is the change of x over a step; "
        "contact forces beyond +-1, which reward_contact clips too",
    ),
    _row(
        "Humanoid-v5",
        ("reward_survive", "reward_forward", "reward_ctrl", "reward_contact"),
        _SPATIAL,
        "the x and y position; reward_forward is the change of the centre of mass's x over a step, which the "
        "bodies' velocities only approximate",
    ),
    _row(
        "Swimmer-v5",
        ("reward_forward", "reward_ctrl"),
        _SPATIAL,
        "the x and y position: reward_forward is the change of x over a step",
    ),
    _row(
        "Reacher-v5",
        ("reward_dist", "reward_ctrl"),
        (),
        "nothing: the vector from fingertip to target is in the observation",
    ),
    _row(
        "Pusher-v5",
        ("reward_dist", "reward_ctrl", "reward_near"),
        (),
        "nothing: the positions of fingertip, object and goal are in the observation",
    ),
    _row(
        "InvertedPendulum-v5",
        ("reward_survive",),
        (),
        "nothing: the reward is 1 until the pole has fallen",
    ),
    _row(
        "InvertedDoublePendulum-v5",
        ("reward_survive", "distance_penalty", "velocity_penalty"),
        (),
        "velocities beyond +-10, which velocity_penalty does not clip",
    ),
    _row(
        "HumanoidStandup-v5",
        ("reward_linup", "reward_quadctrl", "reward_impact"),
        ("x_position", "y_position", "z_distance_from_origin"),
        "nothing: the height of the torso is in the observation",
        alive=1.0,
    ),
)


def terms_among(
    task: Task | None, infos: Mapping[str, Float[np.ndarray, "T"]]
) -> dict[str, Float[np.ndarray, "T"]]:
    """The task's terms by name, of T steps' infos by `info` key; none where one of them is missing."""
    if task is None or any(key not in infos for key in task.terms):
        return {}
    terms = {name: infos[key] for key, name in task.terms.items()}
    steps = len(next(iter(terms.values())))
    return terms | {name: np.full(steps, value) for name, value in task.constants.items()}


def task_of(env_id: str) -> Task | None:
    """The row of `env_id`, version included, or None for a task that is not in the table.

    What the environment is given (`irl.envs.names`) does not matter: the terms are the same.
    """
    return next((task for task in TASKS if task.env_id == env_id.partition("?")[0]), None)


def known_apart(a: str, b: str) -> bool:
    """Whether both are rows of the table, and not the same: then equal sizes are chance.

    So it is with Walker2d and HalfCheetah. What the environment is given does not matter; of a task that is
    not in the table nothing is known.
    """
    first, second = task_of(a), task_of(b)
    return first is not None and second is not None and first is not second


def task_name(env_id: str) -> str:
    """The short name of an environment: `hopper` for `Hopper-v5`, `pendulum` for `Pendulum-v1`.

    An id that is not in the table loses its version; what a folder name or a dataset id cannot hold
    becomes a dash. What the environment is given becomes eight digits: a variant is a task of its own.
    """
    bare, mark, given = env_id.partition("?")
    variant = f"-{zlib.crc32(given.encode()):08x}" if mark else ""
    task = task_of(bare)
    if task is not None:
        return task.name + variant
    without_version = re.sub(r"-v\d+$", "", bare.lower())
    return re.sub(r"[^a-z0-9_]+", "-", without_version).strip("-") + variant
