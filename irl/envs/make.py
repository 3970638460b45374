"""An environment by its id; what cannot be used is refused with one line that says what to type instead."""

import difflib
import json
import os
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Dict, Discrete

from irl.core.errors import UserError
from irl.envs.discrete import OneHotActions
from irl.envs.dynamics import DYNAMICS, MODEL, changed_model, check_felt
from irl.envs.flatten import FlatKeys, part_names
from irl.envs.guard import Guarded
from irl.envs.names import OBS_KEYS, split_name

VARIABLE = "IRL_ENV_MODULES"
"""Environment variable that names the modules which a file may have imported."""

_FLAT = {
    "observations": "e.g. of shape (11,); gymnasium.wrappers.FlattenObservation makes one of many spaces",
    "actions": "e.g. of shape (3,), or a Discrete choice",
}

LIST_HINT = (
    "; `python -c 'import gymnasium; gymnasium.pprint_registry()'` lists those there are; --import MODULE "
    "imports the module that registers yours"
)


def make(env_id: str, **kwargs: Any) -> gym.Env:
    """The Gymnasium environment called `env_id`, with a flat observation and a bounded flat action.

    A choice of actions becomes a row for each (`irl.envs.discrete`), observations in a dictionary the row
    of those parts that `obs_keys` names; `dynamics` changes a MuJoCo model (`irl.envs.dynamics`).

    Args:
        env_id: full name (`irl.envs.names`), e.g. `Hopper-v5`; `module:Name-v0` imports `module` first.
        kwargs: given on to the environment, with those in the name.

    Raises:
        UserError: no such environment, it cannot be built here, or its spaces cannot be used.
    """
    env_id, named = split_name(env_id)
    kwargs = named | kwargs
    keys = kwargs.pop(OBS_KEYS, None)
    changes = kwargs.pop(DYNAMICS, None)
    env = _made(env_id, kwargs) if changes is None else _under(changes, env_id, kwargs)
    try:
        if keys is not None:
            env = FlatKeys(env, env_id, part_names(keys))
        if isinstance(env.action_space, Discrete):
            env = OneHotActions(env)
        _check_spaces(env_id, env)
    except UserError:
        env.close()
        raise
    return Guarded(env, env_id)


def _under(changes: object, env_id: str, kwargs: dict[str, Any]) -> gym.Env:
    """The environment under other dynamics; its specification names those, not a file that is gone."""
    if MODEL in kwargs:
        raise UserError(
            f"{env_id} is given {MODEL} and {DYNAMICS}; change the file, and leave {DYNAMICS} away"
        )
    with changed_model(env_id, changes) as model:
        env = _made(env_id, kwargs | model)
    try:
        check_felt(env, env_id, changes)
    except UserError:
        env.close()
        raise
    if (spec := env.unwrapped.spec) is not None:
        del spec.kwargs[MODEL]
        spec.kwargs[DYNAMICS] = changes
    return env


def _made(env_id: str, kwargs: dict[str, Any]) -> gym.Env:
    with warnings.catch_warnings(), _quiet_compiler():
        # "out of date", "did you mean": said in our own words where it is a mistake
        warnings.filterwarnings("ignore", message=r"(\x1b\[\d+m)?WARN: ")
        # Box2D's import ends the process where a warning is an error, and this is one of SWIG's
        warnings.filterwarnings("ignore", message="builtin type swig", category=DeprecationWarning)
        try:
            # an id without a version would be recorded under a name that is not the environment's
            if env_id not in gym.registry and ":" not in env_id:
                raise UserError(f"there is no environment {env_id!r}{_near(env_id) or LIST_HINT}")
            return gym.make(env_id, **kwargs)
        except UserError:
            raise
        # whatever the environment's own code raises, it cannot be made
        except Exception as error:
            what = (
                "" if isinstance(error, gym.error.Error | ImportError | TypeError) else type(error).__name__
            )
            said = ": ".join(filter(None, (what, _one_line(error))))
            raise UserError(f"cannot make {env_id!r}: {said}{_near(env_id)}") from error


def check_module(env_id: str, where: str) -> None:
    """Refuse an id that was read from a file and would import a module: a file may be somebody else's.

    What is typed is the user's own, and so are the modules that are imported already or named in
    the environment variable IRL_ENV_MODULES (their names, with commas).

    Raises:
        UserError: says how to allow it.
    """
    module, colon, _ = env_id.partition("?")[0].rpartition(":")
    allowed = os.environ.get(VARIABLE, "").split(",")
    if colon and module not in allowed and module not in sys.modules:
        raise UserError(
            f"{where} names the environment {env_id!r}, which would import the module {module!r}; if you "
            f"trust it, allow it: {VARIABLE}={module}"
        )


def near_ids(env_id: str, n: int = 3) -> list[str]:
    """The newest versions of the `n` registered environments whose names resemble that of `env_id`."""
    newest: dict[str, EnvSpec] = {}
    for spec in gym.registry.values():
        key = _bare(f"{spec.namespace or ''}{spec.name}")
        if key not in newest or (spec.version or 0) > (newest[key].version or 0):
            newest[key] = spec
    wanted = _bare(re.sub(r"-?v?\d*$", "", env_id.rpartition(":")[2]))
    close = difflib.get_close_matches(wanted, newest, n=n, cutoff=0.7)
    return [newest[key].id for key in close]


@contextmanager
def _quiet_compiler() -> Iterator[None]:
    """MuJoCo's compiler warnings as Python warnings, without the one about gymnasium's own models."""

    def hear(message: str) -> None:
        # half_cheetah.xml sets it; one line on stderr an environment, and nothing a user could mend
        if "settotalmass" not in message:
            warnings.warn(f"MuJoCo: {message.strip()}", stacklevel=2)

    # the bindings have both, their type stubs lack them
    get, put = (getattr(mujoco, f"{verb}_mju_user_warning") for verb in ("get", "set"))
    before = get()
    put(hear)
    try:
        yield
    finally:
        put(before)


def _near(env_id: str) -> str:
    near = [other for other in near_ids(env_id) if other != env_id]
    return f"; near it: {', '.join(near)}" if near else ""


def _bare(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()).rstrip(".")


def _check_spaces(env_id: str, env: gym.Env) -> None:
    obs, action = env.observation_space, env.action_space
    if isinstance(obs, Dict):
        raise UserError(
            f"{env_id} has the observations {' '.join(str(obs).split()):.120}; expected a flat Box of real "
            f"numbers: name the parts to be put in a row, --env-kwargs "
            f"'{{\"{OBS_KEYS}\": {json.dumps(list(obs.spaces))}}}'"
        )
    check_flat(env_id, "observations", obs)
    check_flat(env_id, "actions", action)
    if not (isinstance(action, Box) and action.is_bounded()):
        raise UserError(f"{env_id} has the actions {action}; expected real numbers with finite bounds")


def check_flat(owner: str, what: str, space: gym.Space) -> None:
    """Refuse a space that is not a flat Box of real numbers: Dict, Tuple, images, discrete ones.

    Raises:
        UserError: names `owner` and the space.
    """
    if not isinstance(space, Box) or len(space.shape) != 1 or not np.issubdtype(space.dtype, np.floating):
        shown = " ".join(str(space).split())
        raise UserError(
            f"{owner} has the {what} {shown:.120}; expected a flat Box of real numbers, {_FLAT[what]}"
        )
