"""The shelf: policies/<task>/<level>/ with policy.safetensors and card.json.

Looked for, in this order: the folder given, IRL_POLICIES_PATH, the source checkout's
expert_data/policies, the policies inside the installed package, ./expert_data/policies.
"""

import os
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from irl.core import files
from irl.core.errors import UserError
from irl.envs.make import check_module
from irl.envs.tasks import task_name
from irl.policies.card import Card, read_card, write_card
from irl.policies.policy import Policy, load_policy, save_policy

POLICY, CARD = "policy.safetensors", "card.json"
_PACKAGE = Path(__file__).parent.parent


@dataclass(frozen=True)
class Shelved:
    """A policy of the shelf with its card."""

    policy: Policy
    card: Card
    path: Path

    def __call__(self, obs: Float[np.ndarray, "O"]) -> Float[np.ndarray, "A"]:
        """The policy's action: it is played as it is, without taking it out first."""
        return self.policy(obs)


def roots(root: Path | None = None) -> list[Path]:
    """Every folder that may hold policies, the first to be written to."""
    found = [root] if root else []
    if given := os.environ.get("IRL_POLICIES_PATH"):
        found.append(Path(given))
    if (_PACKAGE.parent / "pyproject.toml").is_file():
        found.append(_PACKAGE.parent / "expert_data" / "policies")
    return [*found, _PACKAGE / "expert_data" / "policies", Path("expert_data/policies")]


def writable_root(root: Path | None = None) -> Path:
    """Where a new policy goes: the first root that is not inside the installed package."""
    inside = _PACKAGE / "expert_data" / "policies"
    return next(folder for folder in roots(root) if folder != inside)


def check_level(level: str) -> None:
    """Refuse what is not the name of one folder.

    Raises:
        UserError: it could lead elsewhere, as ../x would.
    """
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,60}", level):
        raise UserError(f"{level!r:.80} is not a level; expected letters, digits, _ and -, e.g. expert")


def check_place(place: Path, env_id: str) -> None:
    """Refuse the folder of another task's policy: tasks with one short name, as versions are, share one.

    Raises:
        UserError: the card there is of another task.
    """
    if not (place / CARD).is_file():
        return
    try:
        there = read_card(place / CARD).env_id
    except UserError:
        # a damaged card says nothing, and training again is what mends it
        return
    if there != env_id:
        raise UserError(
            f"{place} holds the policy of {there}, and one of {env_id} would lie in the same folder; put it "
            f"on another shelf with --policies-root FOLDER"
        )


def find(env_id: str, level: str = "expert", root: Path | None = None) -> Shelved:
    """The policy of a task.

    Raises:
        UserError: there is none, or its weights are not the ones its card was made for.
    """
    check_level(level)
    for folder in roots(root):
        path = folder / task_name(env_id) / level
        if (path / CARD).is_file():
            card = read_card(path / CARD)
            if card.env_id == env_id:
                return _load(path, card)
    there = ", ".join(f"{s.env_id} {s.level}" for s in cards(root)) or "none"
    raise UserError(
        f"no {level} policy for {env_id} on the shelf (there: {there}); "
        f"train one with: irl experts train --env-id {env_id}"
    )


def cards(root: Path | None = None) -> list[Card]:
    """The card of every shelved policy; a task and level found twice counts once, as `find` would."""
    return [card for card, _ in folders(root)]


def folders(root: Path | None = None) -> list[tuple[Card, Path]]:
    """The card of every shelved policy with its folder; see `cards`."""
    found: dict[tuple[str, str], tuple[Card, Path]] = {}
    for folder in roots(root):
        for path in sorted(folder.glob(f"*/*/{CARD}")):
            card = read_card(path)
            found.setdefault((card.env_id, card.level), (card, path.parent))
    return list(found.values())


def to_play(level: str | None, root: Path | None = None) -> list[Card]:
    """The cards of that level, or of every one where it is None, to make the environments that they name.

    Raises:
        UserError: one names an environment whose module is not to be imported on a file's word.
    """
    wanted = [(card, folder) for card, folder in folders(root) if level in (None, card.level)]
    for card, folder in wanted:
        check_module(card.env_id, str(folder / CARD))
    return [card for card, _ in wanted]


def write(folder: Path, policy: Policy, card: Card) -> None:
    """Write a policy and its card as one folder, replacing what was there."""
    with files.new_folder(folder) as aside:
        save_policy(policy, aside / POLICY)
        write_card(replace(card, weights_sha256=files.sha256(aside / POLICY)), aside / CARD)


def _load(path: Path, card: Card) -> Shelved:
    digest = files.sha256(path / POLICY) if (path / POLICY).is_file() else "missing"
    if digest != card.weights_sha256:
        raise UserError(
            f"{path / POLICY} is not the file its card describes (sha256 {digest[:12]}, the card says "
            f"{card.weights_sha256[:12]}); restore it or train again with: "
            f"irl experts train --env-id {card.env_id} --overwrite"
        )
    policy = load_policy(path / POLICY)
    if policy.spec.env_id != card.env_id:
        raise UserError(
            f"{path / POLICY} is a policy of {policy.spec.env_id}, its card says {card.env_id}; "
            f"train again with: irl experts train --env-id {card.env_id} --overwrite"
        )
    return Shelved(policy, card, path)


def expert_card(env_id: str, root: Path | None = None) -> Card | None:
    """The card of a task's expert, None where the shelf has none.

    Raises:
        UserError: there is one, and it is damaged.
    """
    known = any((card.env_id, card.level) == (env_id, "expert") for card in cards(root))
    return find(env_id, "expert", root).card if known else None
