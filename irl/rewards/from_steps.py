"""How the terms of each MuJoCo task follow from its steps: from (a, s', terminated) all but one, the rest.

    task                       rest       the others
    Hopper, Walker2d           forward    ctrl = -w |a|^2,  survive = h if not terminated
    HalfCheetah, Swimmer       forward    ctrl
    Ant                        forward    ctrl, survive, contact = -w |s'[27:]|^2
    Humanoid                   forward    ctrl, survive, contact = -min(w |s'[-78:]|^2, 10)
    HumanoidStandup            linup      quadctrl, impact as contact of Humanoid, alive = 1
    Reacher                    dist       ctrl
    Pusher                     dist       ctrl, near = -w |object - tip|
    InvertedPendulum           survive    none
    InvertedDoublePendulum     distance_penalty   survive, velocity_penalty = -(.001 v1^2 + .005 v2^2)

Weights are those of gymnasium 1.4.0; a test holds each row against the live environment.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from irl.core.errors import UserError
from irl.core.types import Episode

Terms = dict[str, Float[np.ndarray, "T"]]
Weights = Mapping[str, float]

NO_MATTER = {"forward_reward_weight", "max_episode_steps", "reset_noise_scale", "reward_dist_weight"}
"""What a task may be given without these terms being made otherwise: the rest follows from the reward."""

_MOST_CONTACT = 10.0
"""What Humanoid and HumanoidStandup pay for contacts at most."""
_CLIP = 10.0
"""Where InvertedDoublePendulum's observation cuts velocities off."""


@dataclass(frozen=True)
class Rule:
    """One task's."""

    rest: str
    """The term that is what the others leave of the reward."""
    others: Callable[[Episode, Weights], Terms]
    obs_size: int
    weights: Weights
    """As the task has them unless it is given others, under its own names."""


def _ctrl(e: Episode, weight: float, dtype: Any = None) -> Float[np.ndarray, "T"]:
    # in the actions' own dtype, as the environments do: Python's weight leaves float32 what it is
    cost = weight * np.sum(np.square(e.action.astype(dtype or e.action.dtype)), axis=1)
    return -cost.astype(np.float64)


def _survive(e: Episode, bonus: float) -> Float[np.ndarray, "T"]:
    paid = np.full(len(e), bonus)
    paid[-1] *= not e.terminated
    return paid


def _contact(e: Episode, weight: float, size: int, most: float = np.inf) -> Float[np.ndarray, "T"]:
    return -np.minimum(weight * np.sum(np.square(e.obs[1:, -size:]), axis=1), most)


def _planar(e: Episode, w: Weights) -> Terms:
    return {"ctrl": _ctrl(e, w["ctrl_cost_weight"]), "survive": _survive(e, w["healthy_reward"])}


def _driven(e: Episode, w: Weights) -> Terms:
    return {"ctrl": _ctrl(e, w["ctrl_cost_weight"])}


def _ant(e: Episode, w: Weights) -> Terms:
    return _planar(e, w) | {"contact": _contact(e, w["contact_cost_weight"], 78)}


def _humanoid(e: Episode, w: Weights) -> Terms:
    return {
        # of the simulator's controls, which are float64
        "ctrl": _ctrl(e, w["ctrl_cost_weight"], np.float64),
        "survive": _survive(e, w["healthy_reward"]),
        "contact": _contact(e, w["contact_cost_weight"], 78, _MOST_CONTACT),
    }


def _standup(e: Episode, w: Weights) -> Terms:
    return {
        "quadctrl": _ctrl(e, w["ctrl_cost_weight"], np.float64),
        "impact": _contact(e, w["impact_cost_weight"], 78, _MOST_CONTACT),
    }


def _reacher(e: Episode, w: Weights) -> Terms:
    return {"ctrl": _ctrl(e, w["reward_control_weight"])}


def _pusher(e: Episode, w: Weights) -> Terms:
    tip, thing = e.obs[1:, 14:17], e.obs[1:, 17:20]
    near = -w["reward_near_weight"] * np.linalg.norm(thing - tip, axis=1)
    return {"ctrl": _ctrl(e, w["reward_control_weight"]), "near": near}


def _double(e: Episode, w: Weights) -> Terms:
    v = e.obs[1:, 6:8]
    if (fast := np.abs(v) >= _CLIP).any():
        raise UserError(
            f"the velocity at step {int(np.argmax(fast.any(axis=1)))} is at {_CLIP:g}, where the observation "
            f"cuts it off: the terms of InvertedDoublePendulum-v5 cannot be told from these steps"
        )
    penalty = 1e-3 * v[:, 0] ** 2 + 5e-3 * v[:, 1] ** 2
    return {"survive": _survive(e, w["healthy_reward"]), "velocity_penalty": -penalty}


RULES: dict[str, Rule] = {
    "Hopper-v5": Rule("forward", _planar, 11, {"ctrl_cost_weight": 1e-3, "healthy_reward": 1.0}),
    "HalfCheetah-v5": Rule("forward", _driven, 17, {"ctrl_cost_weight": 0.1}),
    "Walker2d-v5": Rule("forward", _planar, 17, {"ctrl_cost_weight": 1e-3, "healthy_reward": 1.0}),
    "Ant-v5": Rule(
        "forward", _ant, 105, {"ctrl_cost_weight": 0.5, "contact_cost_weight": 5e-4, "healthy_reward": 1.0}
    ),
    "Humanoid-v5": Rule(
        "forward",
        _humanoid,
        348,
        {"ctrl_cost_weight": 0.1, "contact_cost_weight": 5e-7, "healthy_reward": 5.0},
    ),
    "Swimmer-v5": Rule("forward", _driven, 8, {"ctrl_cost_weight": 1e-4}),
    "Reacher-v5": Rule("dist", _reacher, 10, {"reward_control_weight": 1.0}),
    "Pusher-v5": Rule("dist", _pusher, 23, {"reward_control_weight": 0.1, "reward_near_weight": 0.5}),
    "InvertedPendulum-v5": Rule("survive", lambda e, w: {}, 4, {}),
    "InvertedDoublePendulum-v5": Rule("distance_penalty", _double, 9, {"healthy_reward": 10.0}),
    "HumanoidStandup-v5": Rule("linup", _standup, 348, {"ctrl_cost_weight": 0.1, "impact_cost_weight": 5e-7}),
}
