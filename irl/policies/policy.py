"""A trained policy as a few numpy arrays: acting needs no learner and no tensor.

    x = clip((obs - mean) / std, -c, c);  m = mlp(x)
    gaussian:           action = clip(m, low, high)
    squashed_gaussian:  action = low + (tanh(m) + 1) / 2 * (high - low)
    deterministic:      the same action, and nothing is ever drawn
    categorical:        action = the row of zeros with a one where m is largest

Saved as one safetensors file whose header holds the specification as JSON. About 15 microseconds a
call for two hidden layers of 64.
"""

import itertools
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import gymnasium as gym
import numpy as np
from jaxtyping import Float
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from irl.core import files
from irl.core.config import from_json
from irl.core.errors import UserError
from irl.core.nets import CLIP
from irl.envs.tasks import known_apart

FORMAT, VERSION = "irl.policy", 1


def _relu(x: np.ndarray) -> np.ndarray:
    return np.maximum(x, 0.0)


# named functions, so that a policy can be sent to another process
_ACTIVATIONS = {"tanh": np.tanh, "relu": _relu}
_DISTRIBUTIONS = ("gaussian", "squashed_gaussian", "deterministic", "categorical")


@dataclass(frozen=True)
class PolicySpec:
    """What the weights of a policy mean."""

    env_id: str
    obs_dim: int
    action_dim: int
    hidden: tuple[int, ...]
    activation: str
    distribution: str
    """`gaussian` (clipped to the bounds), `squashed_gaussian` (tanh, scaled to the bounds), `deterministic`
    (the same, without a deviation), or `categorical` (a choice of actions, each a row with a single one)."""


class Policy:
    """An exported policy: call it with an observation to get the mean action in environment units.

    Weights are `layers.<i>.weight (out, in)`, `layers.<i>.bias`, `log_std (A,)` or, for a
    state-dependent one, `log_std.weight (A, H)` and `log_std.bias` (a choice and a deterministic one have
    neither), `obs_mean`, `obs_std (O,)`, `action_low` and `action_high (A,)`, and `obs_clip ()` unless the
    bound is 10.
    """

    def __init__(self, spec: PolicySpec, weights: dict[str, np.ndarray]) -> None:
        self.spec = spec
        self.weights = {name: np.asarray(value, dtype=np.float32) for name, value in weights.items()}
        self._check_shapes()
        self._layers = [
            (self.weights[f"layers.{i}.weight"], self.weights[f"layers.{i}.bias"])
            for i in range(len(spec.hidden) + 1)
        ]
        self._activation = _ACTIVATIONS[spec.activation]
        self._low, self._high = self.weights["action_low"], self.weights["action_high"]
        self._clip = self.weights.get("obs_clip", np.float32(CLIP))

    def __repr__(self) -> str:
        s = self.spec
        return f"Policy({s.env_id}, {s.obs_dim} -> {s.hidden} -> {s.action_dim}, {s.distribution})"

    def __call__(self, obs: Float[np.ndarray, "O"]) -> Float[np.ndarray, "A"]:
        """The deterministic action."""
        return self._bounded(self._mean(self._features(obs)))

    @property
    def draws(self) -> bool:
        """Whether there is a distribution to draw from."""
        return self.spec.distribution != "deterministic"

    def sample(self, obs: Float[np.ndarray, "O"], rng: np.random.Generator) -> Float[np.ndarray, "A"]:
        """An action drawn from the policy's own distribution; the one action of a deterministic policy."""
        features = self._features(obs)
        mean = self._mean(features)
        if self.spec.distribution == "categorical":
            # the largest of logits with Gumbel noise is drawn with the probability that they say
            return self._bounded(mean + rng.gumbel(size=len(mean)))
        if not self.draws:
            return self._bounded(mean)
        std = np.exp(self._log_std(features))
        noise = rng.standard_normal(len(mean), dtype=np.float32)
        return self._bounded(mean + std * noise)

    def _features(self, obs: np.ndarray) -> np.ndarray:
        x = (obs - self.weights["obs_mean"]) / self.weights["obs_std"]
        x = np.minimum(np.maximum(x, -self._clip), self._clip).astype(np.float32)
        for weight, bias in self._layers[:-1]:
            x = self._activation(weight @ x + bias)
        return x

    def _mean(self, features: np.ndarray) -> np.ndarray:
        weight, bias = self._layers[-1]
        return weight @ features + bias

    def _log_std(self, features: np.ndarray) -> np.ndarray:
        if "log_std" in self.weights:
            return self.weights["log_std"]
        head = self.weights["log_std.weight"] @ features + self.weights["log_std.bias"]
        # the bounds SB3's SAC keeps its own log standard deviation within
        return np.clip(head, -20.0, 2.0)

    def _bounded(self, action: np.ndarray) -> np.ndarray:
        if self.spec.distribution == "categorical":
            return (np.arange(len(action)) == np.argmax(action)).astype(np.float32)
        if self.spec.distribution in ("squashed_gaussian", "deterministic"):
            return self._low + (np.tanh(action) + 1.0) / 2.0 * (self._high - self._low)
        return np.minimum(np.maximum(action, self._low), self._high)

    def _check_shapes(self) -> None:
        spec = self.spec
        if spec.activation not in _ACTIVATIONS or spec.distribution not in _DISTRIBUTIONS:
            raise ValueError(f"unknown activation or distribution in {spec}")
        sizes = (spec.obs_dim, *spec.hidden, spec.action_dim)
        expected: dict[str, tuple[int, ...]] = {"obs_mean": sizes[:1], "obs_std": sizes[:1]}
        expected |= {"action_low": sizes[-1:], "action_high": sizes[-1:]}
        if "obs_clip" in self.weights:
            expected["obs_clip"] = ()
        for i, (inputs, outputs) in enumerate(itertools.pairwise(sizes)):
            expected |= {f"layers.{i}.weight": (outputs, inputs), f"layers.{i}.bias": (outputs,)}
        if "log_std" in self.weights and self.draws:
            expected["log_std"] = sizes[-1:]
        elif spec.distribution in ("gaussian", "squashed_gaussian"):
            expected |= {"log_std.weight": (sizes[-1], sizes[-2]), "log_std.bias": sizes[-1:]}
        for name, shape in expected.items():
            found = self.weights[name].shape if name in self.weights else None
            if found != shape:
                raise ValueError(f"{name}: expected shape {shape}, found {found}")
        if unexpected := sorted(set(self.weights) - set(expected)):
            raise ValueError(f"unexpected weights: {unexpected}")


def save_policy(policy: Policy, path: Path) -> None:
    """Write the policy; `load_policy(path)` acts the same to the bit."""
    header = json.dumps({"format": FORMAT, "version": VERSION, "spec": asdict(policy.spec)})
    # one key: safetensors writes several in a random order, and equal policies should be equal files
    files.write_bytes(path, save(policy.weights, metadata={"irl": header}))


def load_policy(path: Path | str) -> Policy:
    """The policy in a `.safetensors` file.

    Raises:
        UserError: the file is missing, is no policy of this format, or its weights do not fit its
            specification.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(f"no policy file {path}")
    try:
        with safe_open(path, framework="numpy") as file:
            header = json.loads((file.metadata() or {}).get("irl", "{}"))
            weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        if (header.get("format"), header.get("version")) != (FORMAT, VERSION):
            raise ValueError(
                f"expected format {FORMAT} {VERSION}, found {header.get('format')} {header.get('version')}"
            )
        _check_values(weights)
        return Policy(from_json(PolicySpec, header["spec"], "spec"), weights)
    # AttributeError: a header that is no object, and numpy's lack of some types; RecursionError: a deep one
    except (SafetensorError, OSError, LookupError, TypeError, ValueError, AttributeError) as error:
        raise UserError(f"{path} is not a policy this version reads: {error}") from error
    except (RecursionError, MemoryError) as error:
        raise UserError(f"{path} is not a policy this version reads: {type(error).__name__}") from error


def check_policy(policy: Policy, env: gym.Env) -> None:
    """Refuse a policy of another task than `env`'s.

    Raises:
        UserError: its observations or actions are of other sizes; or both tasks are known and differ.
    """
    wanted = env.spec.id if env.spec is not None else type(env.unwrapped).__name__
    has = policy.spec.obs_dim, policy.spec.action_dim
    needs = (env.observation_space.shape or (0,))[0], (env.action_space.shape or (0,))[0]
    if has != needs:
        raise UserError(
            f"the policy of {policy.spec.env_id} takes observations of {has[0]} and gives actions of "
            f"{has[1]}; {wanted} has {needs[0]} and {needs[1]}: choose a policy of this task"
        )
    if known_apart(policy.spec.env_id, wanted):
        raise UserError(
            f"the policy is of {policy.spec.env_id}, which is not {wanted}, though both have observations of "
            f"{has[0]} and actions of {has[1]}: choose a policy of this task"
        )


def _check_values(weights: dict[str, np.ndarray]) -> None:
    """Refuse numbers that no training writes.

    Raises:
        ValueError: names the weights, and what is wrong with them.
    """
    for name, values in weights.items():
        if values.dtype.kind != "f":
            raise ValueError(f"{name} is of {values.dtype}; expected real numbers")
        with np.errstate(over="ignore"):
            finite = np.isfinite(values.astype(np.float32)).all()
        if not finite:
            raise ValueError(f"{name} has values that are not finite")
    for name in ("obs_std", "obs_clip"):
        if name in weights and (weights[name] <= 0.0).any():
            raise ValueError(f"{name} has values that are not positive")
    if {"action_low", "action_high"} <= weights.keys():
        low, high = weights["action_low"], weights["action_high"]
        if low.shape == high.shape and (low > high).any():
            raise ValueError("action_low is above action_high")
