"""A learned reward as files: `spec.json` says what it is, `weights.safetensors` holds the numbers.

    r(s, a) = map(logit(s, a)),   logit(s, a) = mlp([clip((s - mean) / std, +-10), a])

It takes task observations and environment-unit actions, and gives the reward before any scaling that a
learner did (`reward_scale` in the specification records that). One that knows the absorbing state adds the
indicator itself, and what that state pays at a termination (`irl.rewards.tail`). No pickle is read.

Version 1 had no absorbing state and no spectral norm; it is read as one with neither.
"""

import itertools
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from jaxtyping import Float
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from irl.core import files
from irl.core.config import from_json
from irl.core.errors import UserError
from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.rewards import tail
from irl.rewards.maps import MAPS
from irl.rewards.nets import LogitNet, LogitSpec

FORMAT, VERSION = "irl.reward", 2
READABLE = [(FORMAT, 1), (FORMAT, VERSION)]
SPEC, WEIGHTS = "spec.json", "weights.safetensors"
ADDED_IN_2 = {"absorbing_scale": 0.0, "spectral_norm": False}
"""Settings of the network that version 1 did not have."""


@dataclass(frozen=True)
class RewardSpec:
    """What a saved reward is and where it comes from."""

    env_id: str
    method: str
    reward_map: str
    """Name in `irl.rewards.maps.MAPS`."""
    inputs: str
    """What the network sees: `obs, action`."""
    net: LogitSpec
    gamma: float
    """The discount of the learner it was learned beside, and of what the absorbing state pays."""
    reward_scale: float
    """What that learner divided it by at this step."""
    env_steps: int
    provenance: dict[str, Any]


class LearnedReward:
    """A frozen reward: call it with a batch of transitions."""

    def __init__(self, spec: RewardSpec, net: LogitNet) -> None:
        self.spec, self.net = spec, net.eval().requires_grad_(False)

    def __repr__(self) -> str:
        s = self.spec
        return (
            f"LearnedReward({s.method} on {s.env_id}, {s.reward_map}(logit({s.inputs})), {s.env_steps} steps)"
        )

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """High where the expert is likelier than the policy of that time.

        Raises:
            ValueError: the batch is of another task.
        """
        self._check(batch)
        return self.net(batch)

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The reward of each step; high is good. At a termination, with what the absorbing state pays."""
        self._check(batch)
        return tail.reward(self.net, self.spec.reward_map, batch, self.spec.gamma)

    def _check(self, batch: Transitions) -> None:
        given, expected = (batch.obs.shape[1], batch.action.shape[1]), self.spec.net
        if given != (expected.obs_dim, expected.action_dim):
            raise ValueError(
                f"the reward of {self.spec.env_id} takes observations of {expected.obs_dim} and actions of "
                f"{expected.action_dim}, the batch has {given[0]} and {given[1]}"
            )


def save_reward(folder: Path, spec: RewardSpec, net: LogitNet) -> None:
    """Write a reward that `load_reward` gives back."""
    weights = {name: tensor.detach().cpu().contiguous() for name, tensor in net.state_dict().items()}
    files.write_bytes(folder / WEIGHTS, save(weights))
    digest = files.sha256(folder / WEIGHTS)
    content = {"format": FORMAT, "version": VERSION, "weights_sha256": digest, **asdict(spec)}
    files.write_json(folder / SPEC, content)


def load_reward(path: Path | str) -> LearnedReward:
    """The reward in a folder: a reward's own, a snapshot's, or a run's (its last snapshot).

    Raises:
        UserError: there is none, it is of a newer format, or its weights do not fit its specification.
    """
    folder = _reward_folder(Path(path))
    content = files.read_json(folder / SPEC)
    try:
        if not isinstance(content, dict):
            raise TypeError(f"expected an object in {SPEC}, found {content!r:.80}")
        if (name := content.pop("format"), version := content.pop("version")) not in READABLE:
            raise ValueError(f"expected format {FORMAT} 1 to {VERSION}, found {name!r:.40} {version!r:.10}")
        if (digest := files.sha256(folder / WEIGHTS)) != (named := content.pop("weights_sha256")):
            raise ValueError(f"{WEIGHTS} has sha256 {digest[:12]}, {SPEC} says {named!r:.14}")
        if version == 1 and isinstance(content.get("net"), dict):
            content["net"] = ADDED_IN_2 | content["net"]
        spec = from_json(RewardSpec, content, SPEC)
        if spec.reward_map not in MAPS:
            raise ValueError(f"unknown map {spec.reward_map!r}; known: {', '.join(MAPS)}")
        weights = load((folder / WEIGHTS).read_bytes())
        _check_weights(spec.net, weights)
        net = LogitNet(spec.net, Normaliser(spec.net.obs_dim), torch.Generator())
        net.load_state_dict(weights)
    except (OSError, SafetensorError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise UserError(f"{folder} is not a reward this version reads: {json.dumps(str(error))}") from error
    return LearnedReward(spec, net)


def _check_weights(spec: LogitSpec, weights: dict[str, Tensor]) -> None:
    """Refuse weights that are not finite, and a specification of more than there are.

    Raises:
        ValueError: named, before memory is asked for on the specification's word.
    """
    for name, values in weights.items():
        if not (values.is_floating_point() and torch.isfinite(values).all()):
            raise ValueError(f"{name} has values that are not finite numbers")
    sizes = (spec.inputs, *spec.hidden, 1)
    claimed = sum(inputs * outputs for inputs, outputs in itertools.pairwise(sizes))
    held = sum(values.numel() for values in weights.values())
    if min(spec.obs_dim, spec.action_dim, *spec.hidden) < 1 or claimed > max(held, 10**6):
        raise ValueError(
            f"{SPEC} says {sizes} units a layer, which the {held} numbers of {WEIGHTS} do not fit"
        )


def _reward_folder(path: Path) -> Path:
    snapshots = sorted((path / "snapshots").glob("*/reward")) if (path / "snapshots").is_dir() else []
    for folder in (path, path / "reward", *snapshots[-1:]):
        if (folder / SPEC).is_file():
            return folder
    raise UserError(f"no reward in {path}: expected {path / SPEC}, {path / 'reward' / SPEC} or snapshots")
