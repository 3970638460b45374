"""A policy as a Stable-Baselines3 zip: what `PPO.load`, `SAC.load` and `TD3.load` read, and nothing more.

    gaussian           -> PPO with MlpPolicy
    squashed_gaussian  -> SAC with MlpPolicy
    deterministic      -> TD3 with MlpPolicy

The actor and its observation normaliser are the policy's. A policy has no value function, so the value
network (PPO) or the critics (SAC, TD3) in the zip are random and untrained, the optimisers are new, and every
other setting is Stable-Baselines3's default: it predicts at once, and training it further begins with a
value that knows nothing.

The normaliser is `irl.learners.features.NormalisedFeatures`, which the zip names: loading needs irl
installed. Like every zip of Stable-Baselines3's, it holds pickles: load one only from whom you trust.
"""

import io
from collections.abc import Iterable, Mapping

import numpy as np
import torch
from gymnasium.spaces import Box, Discrete
from stable_baselines3 import PPO, SAC, TD3
from torch import Tensor

from irl.core.nets import ACTIVATIONS, CLIP, MIN_STD
from irl.envs.discrete import OneHot
from irl.learners.features import NormalisedFeatures
from irl.policies.policy import Policy

ALGORITHMS: dict[str, type[PPO] | type[SAC] | type[TD3]] = {
    "gaussian": PPO,
    "squashed_gaussian": SAC,
    "deterministic": TD3,
    "categorical": PPO,
}
"""By a policy's distribution."""


def sb3_zip(policy: Policy, observations: Box, actions: Box | Discrete) -> bytes:
    """The zip whose deterministic prediction is the policy's action, within float32's rounding.

    Args:
        observations: the task's own space; `load(file, env=...)` compares it with its environment's.
        actions: the same.
    Raises:
        ValueError: the policy is not of these spaces, or SB3's networks cannot be it.
    """
    _check(policy, observations, actions)
    model = _untrained(policy, observations, actions)
    state = model.policy.state_dict()
    model.policy.load_state_dict({**state, **_weights(policy, state)})
    buffer = io.BytesIO()
    model.save(buffer)
    return buffer.getvalue()


def _untrained(policy: Policy, observations: Box, actions: Box | Discrete) -> PPO | SAC | TD3:
    """A model of the policy's shape, built as SB3's own `load` does it: from spaces, with no environment."""
    shape = {
        "net_arch": list(policy.spec.hidden),
        "activation_fn": ACTIVATIONS[policy.spec.activation],
        "features_extractor_class": NormalisedFeatures,
        "features_extractor_kwargs": {"clip": float(policy.weights.get("obs_clip", CLIP))},
    }
    algorithm = ALGORITHMS[policy.spec.distribution]
    model = algorithm("MlpPolicy", None, policy_kwargs=shape, device="cpu", _init_setup_model=False)  # pyright: ignore[reportArgumentType]
    model.observation_space, model.action_space, model.n_envs = observations, actions, 1
    # SB3's initialisers draw from the global stream, which is put back as it was
    with torch.random.fork_rng(devices=[]):
        if isinstance(model, SAC):
            # the "auto" of SB3, which asks an environment
            model.target_entropy = -float(policy.spec.action_dim)
        if isinstance(model, SAC | TD3):
            # the memory is not saved, its size is
            size, model.buffer_size = model.buffer_size, 1
            model._setup_model()
            model.buffer_size = size
        else:
            model._setup_model()
    return model


def _weights(policy: Policy, names: dict[str, Tensor]) -> dict[str, Tensor]:
    """The policy's weights under SB3's names; `names` has them all."""
    given = {name: torch.from_numpy(value.copy()) for name, value in policy.weights.items()}
    last = len(policy.spec.hidden)
    squashed = policy.spec.distribution == "squashed_gaussian"
    if policy.spec.distribution == "deterministic":
        return _of_td3(given, last) | _moments(given, names)
    body, head = ("actor.latent_pi", "actor.mu") if squashed else ("mlp_extractor.policy_net", "action_net")
    found: dict[str, Tensor] = {}
    for part in ("weight", "bias"):
        found[f"{head}.{part}"] = given[f"layers.{last}.{part}"]
        for i in range(last):
            # every second module is an activation
            found[f"{body}.{2 * i}.{part}"] = given[f"layers.{i}.{part}"]
    if policy.spec.distribution == "gaussian":
        found["log_std"] = given["log_std"]
    elif squashed and "log_std" in given:
        found["actor.log_std.weight"] = torch.zeros_like(names["actor.log_std.weight"])
        found["actor.log_std.bias"] = given["log_std"]
    elif squashed:
        found |= {f"actor.log_std.{part}": given[f"log_std.{part}"] for part in ("weight", "bias")}
    return found | _moments(given, names)


def _of_td3(given: Mapping[str, Tensor], last: int) -> dict[str, Tensor]:
    """Of the actor, and of its target, which begins where it is."""
    found: dict[str, Tensor] = {}
    for part in ("weight", "bias"):
        for i in range(last + 1):
            for actor in ("actor", "actor_target"):
                found[f"{actor}.mu.{2 * i}.{part}"] = given[f"layers.{i}.{part}"]
    return found


def _moments(given: Mapping[str, Tensor], names: Iterable[str]) -> dict[str, Tensor]:
    """Actor and critics have an extractor each, or share one under several names."""
    found: dict[str, Tensor] = {}
    for name in names:
        if name.endswith("normaliser.mean"):
            found[name] = given["obs_mean"]
        elif name.endswith("normaliser.var"):
            found[name] = given["obs_std"].square()
    return found


def _check(policy: Policy, observations: Box, given: Box | Discrete) -> None:
    spec, weights = policy.spec, policy.weights
    actions = OneHot(given) if isinstance(given, Discrete) else given
    if (observations.shape, actions.shape) != ((spec.obs_dim,), (spec.action_dim,)):
        raise ValueError(
            f"the policy takes observations of {spec.obs_dim} and gives actions of {spec.action_dim}, the "
            f"spaces have {observations.shape} and {actions.shape}"
        )
    if isinstance(given, Discrete) and given.start != 0:
        raise ValueError(f"Stable-Baselines3 knows choices from 0 on, the task has {given}")
    if isinstance(given, Discrete) != (spec.distribution == "categorical"):
        raise ValueError(f"the policy is {spec.distribution}, the task's actions are {given}")
    for name, bound in (("action_low", actions.low), ("action_high", actions.high)):
        if not np.array_equal(weights[name], bound.astype(np.float32)):
            raise ValueError(f"the policy's {name} is {weights[name]}, the task's is {bound}")
    if (weights["obs_std"] < MIN_STD).any():
        raise ValueError(f"an obs_std of the policy is below {MIN_STD}, which the normaliser takes for 1")
    if spec.distribution == "gaussian" and "log_std" not in weights:
        raise ValueError("a Gaussian policy whose deviation depends on the observation is none of SB3's")
