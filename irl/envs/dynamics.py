"""A MuJoCo task under other dynamics: Gymnasium's own model, changed by what the task's name says.

    Hopper-v5?{"dynamics":{"mass":1.5}}          bodies half as heavy again
    Ant-v5?{"dynamics":{"disabled_legs":2}}      the two front legs half as long, and without motors

| change        | of the model                                                     |
|---------------|------------------------------------------------------------------|
| mass          | density and mass of every geometry, hence inertia                |
| gravity       | all of it                                                        |
| friction      | sliding friction of every geometry, the floor's too              |
| damping       | damping of every joint                                           |
| disabled_legs | of Ant: the first so many of its legs, in the model's order      |

A number is a factor. The changed model is an argument (`xml_file`) of the environment, made anew from
Gymnasium's file each time and kept nowhere, so the name and Gymnasium's version say all of it. Rewards,
observations and actions are the task's own. MuJoCo lets two touching geometries share the larger friction.
What a model cannot feel is refused: gravity where no joint bears weight, friction where nothing rubs.

Fu et al. (2018), arXiv:1710.11248, take a reward to an ant of which two front legs are disabled; theirs is
another ant, and how short its legs are is not known here.
"""

import inspect
import json
import os
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from gymnasium.envs.mujoco import mujoco_env
from gymnasium.envs.registration import load_env_creator

from irl.core.errors import UserError
from irl.envs.names import full_name, split_name

DYNAMICS = "dynamics"
"""The argument in a task's name."""
MODEL = "xml_file"
"""The argument of MuJoCo's tasks that names the file of a model."""
FACTORS = ("mass", "gravity", "friction", "damping")
LEGS = "disabled_legs"
SHORT = 0.5
"""Of a leg's length, what a disabled one has."""
ANT = "Ant-v5"
_MOST = 1000.0
_NO_WEIGHT = 1e-9
"""Of a model's weight: what a joint bears below it is rounding."""
_PLACES = 3
"""Postures in which weight is asked for: in one alone it may be balanced."""
_HINT = f"expected factors of {', '.join(FACTORS)} above 0, or {LEGS} of 1 to 3 of {ANT}, e.g. mass=1.5"


def named(words: Sequence[str]) -> tuple[str, ...]:
    """What changes typed as `mass=1.5` add to a task's name, as words for `irl.envs.names.full_name`."""
    return (json.dumps({DYNAMICS: split_name(full_name("", words))[1]}),) if words else ()


@contextmanager
def changed_model(env_id: str, changes: object) -> Iterator[dict[str, Any]]:
    """The keyword arguments that make `env_id` with `changes`, good inside the block.

    Raises:
        UserError: the task is none of MuJoCo's, or a change is not one of the table.
    """
    checked = _checked(env_id, changes)
    root = ET.parse(_asset(env_id)).getroot()
    change(root, checked)
    handle, path = tempfile.mkstemp(suffix=".xml", prefix="irl-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(ET.tostring(root))
        yield {MODEL: path}
    finally:
        Path(path).unlink(missing_ok=True)


def change(root: ET.Element, changes: Mapping[str, float]) -> None:
    """Change a parsed model in place.

    Raises:
        UserError: its gravity or damping is 0, so a factor changes nothing.
    """
    for name, factor in changes.items():
        if name == "mass":
            _scale(root, "geom", "density", 1000.0, factor)
            _scale(root, "geom", "mass", None, factor)
            for compiler in root.iter("compiler"):
                _multiply(compiler, "settotalmass", factor)
        elif name == "gravity":
            option = root.find("option")
            if option is None:
                option = ET.SubElement(root, "option")
            option.set("gravity", option.get("gravity", "0 0 -9.81"))
            _check_not_zero(name, [option])
            _multiply(option, "gravity", factor, every=True)
        elif name == "friction":
            _scale(root, "geom", "friction", 1.0, factor)
        elif name == "damping":
            _check_not_zero(name, root.iter("joint"))
            _scale(root, "joint", "damping", 0.0, factor)
        elif name == LEGS:
            _disable(root, int(factor))


def check_felt(env: gym.Env, env_id: str, changes: object) -> None:
    """Refuse changes that leave every motion of a compiled model as it was.

    Raises:
        UserError: gravity is changed and pulls at no joint, or friction and no contact has any.
    """
    base = env.unwrapped
    # `changed_model` admits no others
    assert isinstance(base, mujoco_env.MujocoEnv)
    assert isinstance(changes, Mapping)
    said = "and a factor changes nothing; choose another change"
    if "gravity" in changes and not _bears_weight(base.model):
        raise UserError(f"no joint of {env_id} feels gravity, {said}")
    if "friction" in changes and not _rubs(base.model):
        raise UserError(f"nothing of {env_id} touches with friction, {said}")


def _bears_weight(model: Any) -> bool:
    """Whether gravity pulls at a joint, in some posture."""
    # the bindings have them, their type stubs lack them
    made, normalise, forward = (getattr(mujoco, n) for n in ("MjData", "mj_normalizeQuat", "mj_forward"))
    data, rng = made(model), np.random.default_rng(0)
    least = _NO_WEIGHT * np.abs(model.opt.gravity).max() * model.body_mass.sum()
    for _ in range(_PLACES):
        data.qpos[:] = model.qpos0 + rng.uniform(-0.5, 0.5, model.nq)
        normalise(model, data.qpos)
        forward(model, data)
        # at rest nothing else is in it
        if np.abs(data.qfrc_bias).max(initial=0.0) > least:
            return True
    return False


def _rubs(model: Any) -> bool:
    """Whether two geometries of two bodies may touch with friction; of one dimension, a contact has none."""
    touches = model.geom_contype[:, None] & model.geom_conaffinity
    touches = ((touches | touches.T) != 0) & (model.geom_bodyid[:, None] != model.geom_bodyid)
    # the larger of two dimensions counts
    rubs = np.maximum(model.geom_condim[:, None], model.geom_condim) > 1
    return bool((touches & rubs).any() or (model.pair_dim > 1).any())


def _check_not_zero(name: str, elements: Iterable[ET.Element]) -> None:
    if not any(float(word) for element in elements for word in element.get(name, "0").split()):
        raise UserError(f"the model's {name} is 0, and a factor leaves it at that; choose another change")


def _scale(root: ET.Element, tag: str, attribute: str, usual: float | None, factor: float) -> None:
    """Multiply an attribute wherever the model states it, and what is `usual` where it does not."""
    for element in root.iter(tag):
        _multiply(element, attribute, factor)
    if not usual:
        return
    default = root.find("default")
    if default is None:
        default = ET.SubElement(root, "default")
    own = default.find(tag)
    if own is None:
        own = ET.SubElement(default, tag)
    if own.get(attribute) is None:
        own.set(attribute, repr(usual * factor))


def _multiply(element: ET.Element, attribute: str, factor: float, every: bool = False) -> None:
    """The first of an attribute's numbers, or every one."""
    if (given := element.get(attribute)) is None:
        return
    numbers = [float(word) for word in given.split()]
    last = len(numbers) if every else 1
    element.set(attribute, " ".join(repr(n * factor if i < last else n) for i, n in enumerate(numbers)))


def _disable(root: ET.Element, legs: int) -> None:
    """Shorten the first `legs` legs of the ant, and take the motors off their joints."""
    torso = root.find("./worldbody/body[@name='torso']")
    # the table admits Ant only
    assert torso is not None
    for leg in torso.findall("body")[:legs]:
        for geom in leg.iter("geom"):
            _multiply(geom, "fromto", SHORT, every=True)
        for body in leg.iter("body"):
            _multiply(body, "pos", SHORT, every=True)
        joints = {joint.get("name") for joint in leg.iter("joint")}
        for motor in root.iter("motor"):
            if motor.get("joint") in joints:
                # not taken out: an action keeps its size
                motor.set("gear", "0")


def _checked(env_id: str, changes: object) -> dict[str, float]:
    if not isinstance(changes, dict) or not changes:
        raise UserError(f"{DYNAMICS} is {changes!r:.60}; {_HINT}")
    for name, value in changes.items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        factor = name in FACTORS and number and 0 < value < _MOST
        legs = name == LEGS and env_id == ANT and value in (1, 2, 3) and number
        if not factor and not legs:
            raise UserError(f"{DYNAMICS} of {env_id} names {name!s:.40}={value!r:.40}; {_HINT}")
    # in one order, so that two ways to say it are one model
    return {name: float(changes[name]) for name in sorted(changes)}


def _asset(env_id: str) -> Path:
    """The file of Gymnasium's model for a task."""
    entry = gym.registry[env_id].entry_point if env_id in gym.registry else None
    creator = load_env_creator(entry) if isinstance(entry, str) else entry
    if not (isinstance(creator, type) and issubclass(creator, mujoco_env.MujocoEnv)):
        raise UserError(f"{env_id} is no MuJoCo task of Gymnasium's, whose {DYNAMICS} could be changed")
    given = inspect.signature(creator).parameters.get(MODEL)
    name = given.default if given is not None else inspect.Parameter.empty
    path = Path(inspect.getfile(mujoco_env)).parent / "assets" / str(name)
    if not path.is_file():
        raise UserError(f"{env_id} takes no model of another file, so its {DYNAMICS} cannot be changed")
    return path
