"""A learned reward as files: `spec.json` says what it is, `weights.safetensors` holds the numbers.

    logit:   r(s, a) = map(logit(s, a)),   logit(s, a) = mlp([clip((s - mean) / std, +-10), a])
    shaped:  r = g(s, a), or f(s, a, s') = g(s, a) + gamma h(s') - h(s), as its reader asks,
             or f - log pi(a|s), pi the policy that a snapshot has beside it

It takes task observations and environment-unit actions, and gives the reward before any scaling that a
learner did (`reward_scale` in the specification records that). One that knows the absorbing state adds the
indicator itself, and what that state pays at a termination (`irl.rewards.tail`). No pickle is read.

Several networks of one kind may be behind it (`irl.rewards.ensemble`).

Version 1 had no absorbing state and no spectral norm, version 2 logits of (s, a) only, version 3 no bound of
log pi, version 4 no ensembles and no logits of (s, a, s'); they are read as such.
"""

import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from irl.core import files
from irl.core.config import from_json, to_json
from irl.core.errors import UserError
from irl.core.nets import Normaliser
from irl.policies.density import Density
from irl.policies.policy import load_policy
from irl.rewards.averaged import averaged, so_far
from irl.rewards.ensemble import EnsembleNet, EnsembleSpec
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.maps import MAPS
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.shaped import ENTROPIC, PARTS, ShapedNet, ShapedSpec

Spec = LogitSpec | ShapedSpec | EnsembleSpec

FORMAT, VERSION = "irl.reward", 5
READABLE = [(FORMAT, version) for version in range(1, VERSION + 1)]
SPEC, WEIGHTS = "spec.json", "weights.safetensors"
ADDED_IN_2 = {"absorbing_scale": 0.0, "spectral_norm": False}
"""Settings of the network that version 1 did not have."""
ADDED_IN_3 = {"sees": "obs_action"}
"""Settings that version 2 did not have."""
ADDED_IN_4 = {"log_pi_bound": 10.0}
"""Settings that version 3 did not have, of g and h."""
POLICY = "policy.safetensors"
"""Of a snapshot, beside the folder of its reward."""


def save_reward(folder: Path, spec: RewardSpec, net: LogitNet | ShapedNet | EnsembleNet) -> None:
    """Write a reward that `load_reward` gives back."""
    weights = {name: tensor.detach().cpu().contiguous() for name, tensor in net.state_dict().items()}
    files.write_bytes(folder / WEIGHTS, save(weights))
    digest = files.sha256(folder / WEIGHTS)
    content = {"format": FORMAT, "version": VERSION, "weights_sha256": digest, **to_json(spec)}
    files.write_json(folder / SPEC, content)


def load_reward(path: Path | str, part: str | None = None, *, average: bool = False) -> LearnedReward:
    """The reward in a folder: a reward's own, a snapshot's, or a run's (its last snapshot).

    Args:
        part: of AIRL's g and f, which one, or f-log-pi of a snapshot; g unless given. Other rewards have
            no parts.
        average: whether to give the mean of the rewards of all snapshots of a run, that of step 0 left out.

    Raises:
        UserError: there is none, it is of a newer format, its weights do not fit its specification, or it
            has no such part or average.
    """
    if average:
        return _average(Path(path), part)
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
    if part is None:
        return LearnedReward(spec, net)
    if part not in (known := (*PARTS, ENTROPIC) if isinstance(_one(net.spec), ShapedSpec) else ()):
        has = f"choose one of {', '.join(known)}" if known else "only AIRL's rewards have; leave it out"
        raise UserError(f"the reward of {spec.method} in {folder} has no part {part!r:.40}; {has}")
    return LearnedReward(replace(spec, reward_map=part), net, _density(folder) if part == ENTROPIC else None)


def _average(run: Path, part: str | None) -> LearnedReward:
    if not (folders := _snapshots(run)):
        raise UserError(f"no rewards to average in {run}: expected a run with {run / 'snapshots'}")
    used = so_far(folders, max(folders))
    return averaged([load_reward(folder, part) for folder in used.values()])


def _density(folder: Path) -> Density:
    """Of the policy of the same snapshot.

    Raises:
        UserError: there is none, or it makes a choice of actions.
    """
    if not (file := folder.parent / POLICY).is_file():
        raise UserError(
            f"{ENTROPIC} needs the policy that {folder} was learned beside, and {file} is not there; "
            f"choose one of {', '.join(PARTS)}"
        )
    try:
        return Density(load_policy(file))
    except ValueError as error:
        raise UserError(f"{file} cannot be used for {ENTROPIC}: {error}") from error


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
        if version == 3 and content["net"].get("kind") == ShapedSpec.KIND:
            content["net"] = ADDED_IN_4 | content["net"]
        elif version < 3:
            added = ADDED_IN_3 | (ADDED_IN_2 if version == 1 else {})
            content["net"] = added | content["net"] | {"kind": LogitSpec.KIND}
    spec = from_json(RewardSpec, content, SPEC)
    if spec.reward_map not in (known := _payable(spec.net)):
        raise ValueError(f"unknown map {spec.reward_map!r}; known: {', '.join(known)}")
    return spec


def _one(spec: Spec) -> LogitSpec | ShapedSpec:
    return spec.of if isinstance(spec, EnsembleSpec) else spec


def _payable(spec: Spec) -> tuple[str, ...]:
    """What a reward of this kind can pay."""
    return tuple(MAPS) if isinstance(_one(spec), LogitSpec) else PARTS


def _empty(spec: Spec) -> LogitNet | ShapedNet | EnsembleNet:
    normaliser, generator = Normaliser(spec.obs_dim), torch.Generator()
    if isinstance(spec, EnsembleSpec):
        return EnsembleNet(spec, normaliser, generator)
    if isinstance(spec, LogitSpec):
        return LogitNet(spec, normaliser, generator)
    return ShapedNet(spec, normaliser, generator)


def _check_weights(spec: Spec, weights: dict[str, Tensor]) -> None:
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


def _snapshots(run: Path) -> dict[int, Path]:
    """The rewards of a run by environment step, the last one last; a folder of another name is none."""
    found = (folder for folder in run.glob("snapshots/*/reward") if folder.parent.name.isdecimal())
    return dict(sorted((int(folder.parent.name), folder) for folder in found))


def _reward_folder(path: Path) -> Path:
    for folder in (path, path / "reward", *list(_snapshots(path).values())[-1:]):
        if (folder / SPEC).is_file():
            return folder
    raise UserError(f"no reward in {path}: expected {path / SPEC}, {path / 'reward' / SPEC} or snapshots")
