"""Who acts in demonstrations: a policy of the shelf, one in a file, or a function of the user's."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from irl.core.errors import UserError
from irl.core.types import ActFn
from irl.envs.make import make
from irl.experiment.judge import finite
from irl.experiment.modules import function_named
from irl.learners.sb3_import import load_sb3
from irl.policies import shelf
from irl.policies.card import Card, measure_random
from irl.policies.policy import check_policy, load_policy


@dataclass(frozen=True)
class Actor:
    """A policy, and what is known of it."""

    act: ActFn
    algorithm: str
    called: str
    """What the demonstrations are said to be of."""
    random_return: float | None
    expert_return: float | None
    """None: that of the demonstrations themselves."""


def shelved(env_id: str, level: str, root: Path | None) -> Actor:
    """The policy of that level on the shelf.

    Raises:
        UserError: there is none, or it is damaged, or of another task.
    """
    env = make(env_id)
    try:
        found = shelf.find(env_id, level, root)
        check_policy(found.policy, env)
    finally:
        env.close()
    card = found.card
    return Actor(found.policy, card.algorithm, level, card.random_return_mean, _reference(card, root))


def named(what: str, env_id: str, vec_normalize: Path | None, root: Path | None) -> Actor:
    """The policy in a .zip of Stable-Baselines3 or a .safetensors of irl, or the function module:function.

    The returns to compare with are those of the task's expert on the shelf, else of random actions, and of
    the demonstrations themselves.

    Raises:
        UserError: it cannot be read, or is of another task; or statistics are given for what takes none.
    """
    path = Path(what)
    if vec_normalize is not None and path.suffix != ".zip":
        raise UserError(f"--vec-normalize belongs to a .zip of Stable-Baselines3's, not to {what!r:.80}")
    env = make(env_id)
    try:
        if path.suffix == ".zip":
            pickles = f"{path}" + (f" and {vec_normalize}" if vec_normalize else "")
            print(
                f"irl: reading {pickles}: pickles can run any code, name only those whose maker you trust",
                file=sys.stderr,
            )
            policy = load_sb3(path, env, vec_normalize)
            act, algorithm = policy, f"Stable-Baselines3 {policy.name}"
        elif path.suffix == ".safetensors":
            act, algorithm = load_policy(path), "irl"
            check_policy(act, env)
        elif ":" in what:
            act, algorithm = _guarded(function_named(what, "--policy"), what), what
        else:
            raise UserError(f"--policy {what!r:.80}: expected FILE.zip, FILE.safetensors or module:function")
    finally:
        env.close()
    card = shelf.expert_card(env_id, root)
    if card is not None:
        return Actor(act, algorithm, path.name, card.random_return_mean, card.measured.return_mean)
    return Actor(act, algorithm, path.name, finite(measure_random(env_id).return_mean), None)


def _guarded(function: Callable[..., Any], name: str) -> ActFn:
    """The function as a policy, whose own errors are the user's to mend."""

    def act(obs: np.ndarray) -> np.ndarray:
        try:
            return np.asarray(function(obs), dtype=np.float64)
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            raise UserError(f"--policy {name} raised {said}; --debug shows where") from error

    return act


def _reference(card: Card, root: Path | None) -> float:
    """The return that counts as one: the expert's, also where a lesser level acts and an expert is there."""
    known = [c for c in shelf.cards(root) if (c.env_id, c.level) == (card.env_id, "expert")]
    return (known or [card])[0].measured.return_mean
