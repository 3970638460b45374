"""A policy out of a zip of Stable-Baselines3's, of whichever algorithm and age.

Only the policy is made: its class and settings are read from the zip, its weights loaded, and the task's own
spaces given to it. Schedules, buffers and spaces, which are what older versions cannot be read by newer ones
for, are left alone; so an older version of the task will do where the spaces differ in their dtype alone.

The policy's class and settings are a pickle, and so are VecNormalize's statistics: reading them can run any
code. They are read because the user named the file, and for no other reason.
"""

import inspect
import json
import warnings
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.spaces import Box, Discrete
from jaxtyping import Float
from stable_baselines3.common.policies import ActorCriticPolicy, BasePolicy
from stable_baselines3.common.save_util import load_from_zip_file
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from irl.core.errors import UserError
from irl.envs.discrete import OneHot

READ = ("policy_class", "policy_kwargs")
"""What is unpickled of a zip."""


class SB3Policy:
    """Acts as the model of the zip does, deterministically unless it is asked for a draw."""

    def __init__(self, policy: BasePolicy, normalise: VecNormalize | None, name: str) -> None:
        self._policy, self._normalise, self.name = policy.eval(), normalise, name

    def __call__(self, obs: Float[np.ndarray, "O"]) -> np.ndarray:
        """The action in environment units; of a choice, its place."""
        return np.asarray(self._policy.predict(self._seen(obs), deterministic=True)[0])

    def sample(self, obs: Float[np.ndarray, "O"], rng: np.random.Generator) -> np.ndarray:
        """An action drawn from the policy's own distribution.

        Raises:
            UserError: it has none, as of DQN and TD3, or one of a whole rollout (gSDE).
        """
        policy = self._policy
        has = isinstance(policy, ActorCriticPolicy) or hasattr(getattr(policy, "actor", None), "action_dist")
        if not has or getattr(getattr(policy, "actor", policy), "use_sde", False):
            raise UserError(f"{self.name} has no distribution of single actions; leave --stochastic away")
        with torch.random.fork_rng(devices=[]):
            # SB3 draws from torch's global stream
            torch.manual_seed(int(rng.integers(2**63)))
            return np.asarray(policy.predict(self._seen(obs), deterministic=False)[0])

    def _seen(self, obs: np.ndarray) -> np.ndarray:
        seen = obs if self._normalise is None else self._normalise.normalize_obs(obs)
        assert isinstance(seen, np.ndarray)
        return seen.astype(np.float32)


def load_sb3(path: Path, env: gym.Env, vec_normalize: Path | None = None) -> SB3Policy:
    """The policy in a zip, for the task of `env`; it stays usable after `env` is closed.

    Args:
        vec_normalize: statistics that `VecNormalize.save` wrote beside it.

    Raises:
        UserError: a file is missing or damaged, of other spaces, or of a library that is not installed.
    """
    data = _settings(path)
    observations, actions = env.observation_space, env.action_space
    choices = Discrete(int(actions.choices.n)) if isinstance(actions, OneHot) else actions
    _check_spaces(path, data, observations, choices)
    try:
        with warnings.catch_warnings(), torch.random.fork_rng(devices=[]):
            # of older versions' settings, which are kept
            warnings.simplefilter("ignore")
            unread = {key: value for key, value in data.items() if key not in READ}
            found, params, _ = load_from_zip_file(path, device="cpu", custom_objects=unread)
            assert found is not None
            policy = _policy(found, observations, choices)
            weights: Any = params["policy"]
            policy.load_state_dict(weights)
    except ModuleNotFoundError as error:
        said = "; pip install sb3-contrib" if (error.name or "").startswith("sb3_contrib") else ""
        raise UserError(f"{path} needs {error.name}, which is not installed{said}") from error
    # whatever the pickle and the policy's own code make of what is in there
    except Exception as error:
        raise UserError(f"{path} holds no policy that can be made: {_one_line(error)}") from error
    statistics = _statistics(vec_normalize, env) if vec_normalize is not None else None
    return SB3Policy(policy, statistics, type(policy).__name__)


def _settings(path: Path) -> dict[str, Any]:
    """The readable half of a zip: nothing of it is unpickled."""
    if not path.is_file():
        raise UserError(f"no file {path}")
    try:
        with zipfile.ZipFile(path) as archive:
            data = json.loads(archive.read("data"))
        if not isinstance(data, dict) or "policy_class" not in data:
            raise ValueError("it names no policy_class")
    except (zipfile.BadZipFile, OSError, KeyError, ValueError, RecursionError, RuntimeError) as error:
        raise UserError(f"{path} is no zip of Stable-Baselines3's: {_one_line(error)}") from error
    return data


def _check_spaces(path: Path, data: Mapping[str, Any], observations: gym.Space, actions: gym.Space) -> None:
    for what, space in (("observation", observations), ("action", actions)):
        said = data.get(f"{what}_space")
        if not isinstance(said, dict):
            continue
        has = said["n"] if "n" in said else said.get("_shape")
        needs = str(space.n) if isinstance(space, Discrete) else list(space.shape or ())
        if has is not None and str(has) != str(needs):
            raise UserError(
                f"{path} was trained on {what}s of {has}, the task has {needs}; choose a policy of this task"
            )
        if what == "action" and isinstance(space, Box):
            _check_bounds(path, said, space)


def _check_bounds(path: Path, said: Mapping[str, Any], space: Box) -> None:
    for side in ("low", "high"):
        try:
            bound = np.array(str(said[side]).strip("[]").split(), dtype=np.float64)
        except (KeyError, ValueError):
            return
        own = getattr(space, side)
        if bound.shape == own.shape and not np.allclose(bound, own, rtol=1e-4):
            raise UserError(
                f"{path} was trained with actions whose {side} is {said[side]}, the task's is {own}; choose "
                f"a policy of this task"
            )


def _policy(data: Mapping[str, Any], observations: gym.Space, actions: gym.Space) -> BasePolicy:
    made, settings = data["policy_class"], dict(data["policy_kwargs"] or {})
    if "Recurrent" in made.__name__:
        raise ValueError(
            f"{made.__name__} remembers what it saw, and a demonstration is made of one observation at a "
            f"time; use --policy module:function, a function that keeps the state itself"
        )
    if issubclass(made, ActorCriticPolicy):
        settings["use_sde"] = bool(data.get("use_sde", False))
    # a policy that is not learned by gradients has none
    rate = {"lr_schedule": lambda _: 0.0} if "lr_schedule" in inspect.signature(made).parameters else {}
    return made(observations, actions, **rate, **settings)


def _statistics(path: Path, env: gym.Env) -> VecNormalize:
    if not path.is_file():
        raise UserError(f"no file {path}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = VecNormalize.load(str(path), DummyVecEnv([lambda: env]))
    except Exception as error:
        raise UserError(f"{path} holds no statistics of VecNormalize for it: {_one_line(error)}") from error
    found.training = False
    return found


def _one_line(error: BaseException) -> str:
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said:.300}" if said else type(error).__name__
