"""A learned reward as files: `spec.json` says what it is, `weights.safetensors` holds the numbers.

    logit:   r(s, a) = map(logit(s, a)),   logit(s, a) = mlp([clip((s - mean) / std, +-10), a])
    shaped:  r = g(s, a), or f(s, a, s') = g(s, a) + gamma h(s') - h(s), as its reader asks

It takes task observations and environment-unit actions, and gives the reward before any scaling that a
learner did (`reward_scale` in the specification records that). One that knows the absorbing state adds the
indicator itself, and what that state pays at a termination (`irl.rewards.tail`). No pickle is read.

Version 1 had no absorbing state and no spectral norm, version 2 logits of (s, a) only; they are read as such.
"""

import itertools
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from jaxtyping import Float
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from irl.core import files
from irl.core.config import from_json, to_json
from irl.core.errors import UserError
from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.rewards import tail
from irl.rewards.maps import MAPS
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.shaped import PARTS, ShapedNet, ShapedSpec

FORMAT, VERSION = "irl.reward", 3
READABLE = [(FORMAT, version) for version in range(1, VERSION + 1)]
SPEC, WEIGHTS = "spec.json", "weights.safetensors"
ADDED_IN_2 = {"absorbing_scale": 0.0, "spectral_norm": False}
"""Settings of the network that version 1 did not have."""
ADDED_IN_3 = {"sees": "obs_action"}
"""Settings that version 2 did not have."""


@dataclass(frozen=True)
class RewardSpec:
    """What a saved reward is and where it comes from."""

    env_id: str
    method: str
    reward_map: str
    """Of a logit, a name in `irl.rewards.maps.MAPS`; of g and h, a name in `irl.rewards.shaped.PARTS`."""
    inputs: str
    """What the network sees, in words: `obs, action`."""
    net: LogitSpec | ShapedSpec
    gamma: float
    """The discount of the learner it was learned beside, and of what the absorbing state pays."""
    reward_scale: float
    """What that learner divided it by at this step."""
    env_steps: int
    provenance: dict[str, Any]


class LearnedReward:
    """A frozen reward: call it with a batch of transitions."""

    def __init__(self, spec: RewardSpec, net: LogitNet | ShapedNet) -> None:
        self.spec, self.net = spec, net.eval().requires_grad_(False)

    def __repr__(self) -> str:
        s = self.spec
        of = f"logit({s.inputs})" if isinstance(self.net, LogitNet) else s.inputs
        return f"LearnedReward({s.method} on {s.env_id}, {s.reward_map}({of}), {s.env_steps} steps)"

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        """High where the expert is likelier than the policy of that time.

        Of g and h it is f: AIRL's logit before the log pi of that policy, which is not saved, is taken off.

        Raises:
            ValueError: the batch is of another task.
        """
        self._check(batch)
        return self.net(batch) if isinstance(self.net, LogitNet) else self.net.f(batch, self.spec.gamma)

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The reward of each step; high is good. At a termination, with what the absorbing state pays."""
        self._check(batch)
        if isinstance(self.net, ShapedNet):
            return self.net.paid(self.spec.reward_map, batch, self.spec.gamma)
        return tail.reward(self.net, self.spec.reward_map, batch, self.spec.gamma)

    def anchored(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The same reward with the absorbing state at 0: what each step pays above what s_abs pays a step.

            r(s, a) - r(s_abs),   and nothing after a termination

        Over any episode, followed by s_abs for ever, it adds up to r's discounted sum less r(s_abs) / (1 -
        gamma), which no policy changes. A reward that knows no s_abs is as it was.
        """
        self._check(batch)
        net, pays = self.net, self.spec.reward_map
        if isinstance(net, ShapedNet):
            of_steps = net.g(batch) if pays == "g" else net.f(batch, self.spec.gamma)
            return of_steps - net.a_step_in_absorbing(pays, self.spec.gamma) if _absorbs(net) else of_steps
        of_steps = MAPS[pays](net(batch))
        return of_steps - MAPS[pays](net.of_absorbing()) if _absorbs(net) else of_steps

    def _check(self, batch: Transitions) -> None:
        given, expected = (batch.obs.shape[1], batch.action.shape[1]), self.spec.net
        blind = expected.sees != "obs_action"
        if given[0] != expected.obs_dim or (given[1] != expected.action_dim and not blind):
            raise ValueError(
                f"the reward of {self.spec.env_id} takes observations of {expected.obs_dim} and actions of "
                f"{expected.action_dim}, the batch has {given[0]} and {given[1]}"
            )


def _absorbs(net: LogitNet | ShapedNet) -> bool:
    return net.spec.absorbing_scale > 0


def save_reward(folder: Path, spec: RewardSpec, net: LogitNet | ShapedNet) -> None:
    """Write a reward that `load_reward` gives back."""
    weights = {name: tensor.detach().cpu().contiguous() for name, tensor in net.state_dict().items()}
    files.write_bytes(folder / WEIGHTS, save(weights))
    digest = files.sha256(folder / WEIGHTS)
    content = {"format": FORMAT, "version": VERSION, "weights_sha256": digest, **to_json(spec)}
    files.write_json(folder / SPEC, content)


def load_reward(path: Path | str, part: str | None = None) -> LearnedReward:
    """The reward in a folder: a reward's own, a snapshot's, or a run's (its last snapshot).

    Args:
        part: of AIRL's g and f, which one; g unless given. Other rewards have no parts.
    Raises:
        UserError: there is none, it is of a newer format, its weights do not fit its specification, or it
            has no such part.
    """
    folder = _reward_folder(Path(path))
    content = files.read_json(folder / SPEC)
    try:
        spec = _specification(folder, content)
        weights = load((folder / WEIGHTS).read_bytes())
        _check_weights(spec.net, weights)
        net = _empty(spec.net)
        net.load_state_dict(weights)
    except (OSError, SafetensorError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise UserError(f"{folder} is not a reward this version reads: {json.dumps(str(error))}") from error
    if part is not None:
        if part not in (known := _payable(spec.net) if isinstance(net, ShapedNet) else ()):
            has = f"choose one of {', '.join(known)}" if known else "only AIRL's rewards have; leave it out"
            raise UserError(f"the reward of {spec.method} in {folder} has no part {part!r:.40}; {has}")
        spec = replace(spec, reward_map=part)
    return LearnedReward(spec, net)


def _specification(folder: Path, content: Any) -> RewardSpec:
    """What `SPEC` says, once it is known to be of these weights.

    Raises:
        UserError, ValueError, KeyError, TypeError: it is of another format, or not of them.
    """
    if not isinstance(content, dict):
        raise TypeError(f"expected an object in {SPEC}, found {content!r:.80}")
    if (name := content.pop("format"), version := content.pop("version")) not in READABLE:
        raise ValueError(f"expected format {FORMAT} 1 to {VERSION}, found {name!r:.40} {version!r:.10}")
    if (digest := files.sha256(folder / WEIGHTS)) != (named := content.pop("weights_sha256")):
        raise ValueError(f"{WEIGHTS} has sha256 {digest[:12]}, {SPEC} says {named!r:.14}")
    if version < VERSION and isinstance(content.get("net"), dict):
        added = ADDED_IN_3 | (ADDED_IN_2 if version == 1 else {})
        content["net"] = added | content["net"] | {"kind": LogitSpec.KIND}
    spec = from_json(RewardSpec, content, SPEC)
    if spec.reward_map not in (known := _payable(spec.net)):
        raise ValueError(f"unknown map {spec.reward_map!r}; known: {', '.join(known)}")
    return spec


def _payable(spec: LogitSpec | ShapedSpec) -> tuple[str, ...]:
    """What a reward of this kind can pay."""
    return tuple(MAPS) if isinstance(spec, LogitSpec) else PARTS


def _empty(spec: LogitSpec | ShapedSpec) -> LogitNet | ShapedNet:
    normaliser, generator = Normaliser(spec.obs_dim), torch.Generator()
    if isinstance(spec, LogitSpec):
        return LogitNet(spec, normaliser, generator)
    return ShapedNet(spec, normaliser, generator)


def _check_weights(spec: LogitSpec | ShapedSpec, weights: dict[str, Tensor]) -> None:
    """Refuse weights that are not finite, and a specification of more than there are.

    Raises:
        ValueError: named, before memory is asked for on the specification's word.
    """
    for name, values in weights.items():
        if not (values.is_floating_point() and torch.isfinite(values).all()):
            raise ValueError(f"{name} has values that are not finite numbers")
    layers = [pair for sizes in spec.sizes for pair in itertools.pairwise(sizes)]
    claimed = sum(inputs * outputs for inputs, outputs in layers)
    held = sum(values.numel() for values in weights.values())
    least = min(spec.obs_dim, spec.action_dim, *(units for sizes in spec.sizes for units in sizes))
    if least < 1 or claimed > max(held, 10**6):
        units = " and ".join(str(sizes) for sizes in spec.sizes)
        raise ValueError(
            f"{SPEC} says {units} units a layer, which the {held} numbers of {WEIGHTS} do not fit"
        )


def _reward_folder(path: Path) -> Path:
    snapshots = sorted((path / "snapshots").glob("*/reward")) if (path / "snapshots").is_dir() else []
    for folder in (path, path / "reward", *snapshots[-1:]):
        if (folder / SPEC).is_file():
            return folder
    raise UserError(f"no reward in {path}: expected {path / SPEC}, {path / 'reward' / SPEC} or snapshots")
