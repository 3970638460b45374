import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from irl.core.errors import UserError
from irl.core.types import ActFn
from irl.envs.make import make
from irl.envs.rollouts import rollout
from irl.policies import shelf
from irl.policies.card import Card, measure, read_card
from irl.policies.policy import Policy, load_policy, save_policy
from tests import pointmass

SHIPPED = Path(__file__).parents[2] / "expert_data" / "policies"
FOLDERS = sorted(path.parent for path in SHIPPED.glob(f"*/*/{shelf.CARD}"))


ROUNDING = 0.03
"""How far a return on another processor may be: a thousand steps of a running body make the last digit of a
product, which processors round in their own ways, into the third of the return."""

DEVIATIONS = 4
"""The same in standard deviations over the card's episodes, where those differ by more: such an episode is
another one on another processor."""


def repeats_its_card(act: ActFn, card: Card, episodes: int = 3) -> bool:
    """Whether `act` earns, in the first episodes of the card, what the card says."""
    again = measure(card.env_id, act, list(card.measured.episode_seeds[:episodes]))
    expected = card.measured
    return again.lengths == expected.lengths[:episodes] and again.returns == pytest.approx(
        expected.returns[:episodes], rel=1e-6
    )


def agrees_with_its_card(act: ActFn, card: Card, episodes: int = 5) -> bool:
    """Whether most episodes are the card's, on any processor: a digest, elsewhere, sees what this cannot.

    Not all: HalfCheetah's medium policy falls on its back in 2 of 20 episodes where the processor rounds one
    way, and in none where it rounds in another.
    """
    expected = card.measured
    again = measure(card.env_id, act, list(expected.episode_seeds[:episodes]))
    far = max(ROUNDING * abs(expected.return_mean), DEVIATIONS * expected.return_std)
    whole = len(set(expected.lengths)) == 1
    pairs = zip(again.returns, expected.returns, again.lengths, expected.lengths, strict=False)
    near = sum(
        abs(here - there) <= far and (not whole or long == length) for here, there, long, length in pairs
    )
    return near > episodes / 2


def perturbed(policy: Policy) -> Policy:
    """The policy with one weight of its first layer moved by 0.1."""
    weights = {name: value.copy() for name, value in policy.weights.items()}
    weights["layers.0.weight"][0, 0] += 0.1
    return Policy(policy.spec, weights)


def a_card(policy: Policy, level: str = "expert") -> Card:
    return Card(
        env_id=policy.spec.env_id,
        level=level,
        algorithm="hand",
        steps=0,
        seed=0,
        measured=measure(policy.spec.env_id, policy, [1, 2, 3]),
        random_return_mean=-20.0,
        random_return_std=1.0,
        settings={},
        versions={},
        command="",
    )


def put(root: Path, level: str = "expert", note: str = "") -> Path:
    """The point mass's expert, shelved below `root`."""
    policy = pointmass.expert()
    folder = root / "pointmass" / level
    shelf.write(folder, policy, replace(a_card(policy, level), command=note))
    return folder


@pytest.fixture
def nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder to be in, an installed package without a checkout, and no variable set."""
    monkeypatch.delenv("IRL_POLICIES_PATH", raising=False)
    monkeypatch.setattr(shelf, "_PACKAGE", tmp_path / "site" / "irl")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path


def test_what_was_written_is_found_again(nowhere: Path) -> None:
    folder = put(nowhere / "shelf")
    found = shelf.find("PointMass-v0", root=nowhere / "shelf")
    assert found.path == folder
    assert found.card == read_card(folder / shelf.CARD)
    assert found.policy.spec.env_id == "PointMass-v0"
    np.testing.assert_array_equal(found.policy(np.array([0.1, -3.0])), [-0.5, 1.0])
    # as it comes, it is played
    env = make("PointMass-v0")
    np.testing.assert_array_equal(rollout(env, found, 3).obs, rollout(env, found.policy, 3).obs)
    env.close()
    assert sorted(path.name for path in folder.iterdir()) == [shelf.CARD, shelf.POLICY]


def test_the_places_are_looked_through_in_order(nowhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (nowhere / "site" / "pyproject.toml").parent.mkdir()
    (nowhere / "site" / "pyproject.toml").touch()
    monkeypatch.setenv("IRL_POLICIES_PATH", str(nowhere / "variable"))
    places = {
        "given": nowhere / "given",
        "variable": nowhere / "variable",
        "checkout": nowhere / "site" / "expert_data" / "policies",
        "package": nowhere / "site" / "irl" / "expert_data" / "policies",
        "here": nowhere / "here" / "expert_data" / "policies",
    }
    assert [place.absolute() for place in shelf.roots(nowhere / "given")] == list(places.values())
    # from the last to the first: each that is filled comes before those behind it
    for name, place in reversed(places.items()):
        put(place, note=name)
        assert shelf.find("PointMass-v0", root=nowhere / "given").card.command == name
        assert [card.command for card in shelf.cards(nowhere / "given")] == [name]


def test_without_a_checkout_its_folder_is_not_a_place(nowhere: Path) -> None:
    put(nowhere / "site" / "expert_data" / "policies")
    with pytest.raises(UserError, match="no expert policy"):
        shelf.find("PointMass-v0")


def test_a_new_policy_is_not_put_inside_the_package(nowhere: Path) -> None:
    assert shelf.writable_root().absolute() == nowhere / "here" / "expert_data" / "policies"
    assert shelf.writable_root(nowhere / "given") == nowhere / "given"


def test_a_task_without_a_policy_says_how_to_train_one(nowhere: Path) -> None:
    with pytest.raises(UserError) as caught:
        shelf.find("Swimmer-v5")
    assert "no expert policy for Swimmer-v5 on the shelf (there: none)" in str(caught.value)
    assert str(caught.value).endswith("train one with: irl experts train --env-id Swimmer-v5")
    put(nowhere / "shelf", "medium")
    with pytest.raises(UserError, match=r"no expert policy .*there: PointMass-v0 medium"):
        shelf.find("PointMass-v0", root=nowhere / "shelf")
    assert shelf.find("PointMass-v0", "medium", nowhere / "shelf").card.level == "medium"


def test_the_policy_of_another_version_of_the_task_is_not_taken(nowhere: Path) -> None:
    put(nowhere / "shelf")
    with pytest.raises(UserError, match="no expert policy for PointMass-v1"):
        shelf.find("PointMass-v1", root=nowhere / "shelf")


def test_a_place_is_one_tasks(nowhere: Path) -> None:
    shelf.check_place(nowhere / "shelf" / "pointmass" / "expert", "PointMass-v1")
    folder = put(nowhere / "shelf")
    shelf.check_place(folder, "PointMass-v0")
    with pytest.raises(UserError) as caught:
        shelf.check_place(folder, "PointMass-v1")
    assert str(caught.value) == (
        f"{folder} holds the policy of PointMass-v0, and one of PointMass-v1 would lie in the same folder; "
        f"put it on another shelf with --policies-root FOLDER"
    )
    # training again is what mends it
    (folder / shelf.CARD).write_text("{")
    shelf.check_place(folder, "PointMass-v1")


def flip_last_bit(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))


@pytest.mark.parametrize("damage", [flip_last_bit, Path.unlink], ids=["one bit", "missing"])
def test_weights_that_are_not_the_cards_are_refused(nowhere: Path, damage: Callable[[Path], None]) -> None:
    folder = put(nowhere / "shelf")
    damage(folder / shelf.POLICY)
    with pytest.raises(UserError, match=r"policy\.safetensors") as caught:
        shelf.find("PointMass-v0", root=nowhere / "shelf")
    assert "irl experts train --env-id PointMass-v0 --overwrite" in str(caught.value)


def test_a_damaged_card_is_named(nowhere: Path) -> None:
    folder = put(nowhere / "shelf")
    (folder / shelf.CARD).write_text("{")
    with pytest.raises(UserError, match=r"card\.json"):
        shelf.find("PointMass-v0", root=nowhere / "shelf")


def test_writing_replaces_policy_and_card_together(nowhere: Path) -> None:
    folder = put(nowhere / "shelf")
    policy = perturbed(pointmass.expert())
    shelf.write(folder, policy, a_card(policy))
    found = shelf.find("PointMass-v0", root=nowhere / "shelf")
    assert repeats_its_card(found.policy, found.card)
    assert not repeats_its_card(pointmass.expert(), found.card)


def test_the_looser_comparison_sees_a_policy_that_is_another() -> None:
    found = shelf.find("Ant-v5", root=SHIPPED)
    weights = {name: -value for name, value in found.policy.weights.items()}
    assert not agrees_with_its_card(Policy(found.policy.spec, weights), found.card)
    assert not agrees_with_its_card(
        shelf.find("Hopper-v5", "medium", SHIPPED).policy, shelf.find("Hopper-v5").card
    )


def test_the_comparison_with_a_card_sees_a_moved_weight(nowhere: Path) -> None:
    put(nowhere / "shelf")
    found = shelf.find("PointMass-v0", root=nowhere / "shelf")
    assert repeats_its_card(found.policy, found.card)
    assert not repeats_its_card(perturbed(found.policy), found.card)


# What an expert of the shelf must reach, and whether 18 of its 20 episodes must be whole.
LEAST = {
    "Hopper-v5": (3200, True),
    "HalfCheetah-v5": (10_000, False),
    "Walker2d-v5": (4500, True),
    "Ant-v5": (4500, True),
    "Humanoid-v5": (5000, True),
    "Swimmer-v5": (300, False),
    "Reacher-v5": (-4.5, False),
    "Pusher-v5": (-30, False),
    "InvertedPendulum-v5": (1000, False),
    "InvertedDoublePendulum-v5": (9300, False),
}
EXPERTS = [card for card in shelf.cards(SHIPPED) if card.level == "expert"]


def test_each_of_the_ten_tasks_has_an_expert() -> None:
    assert {card.env_id for card in EXPERTS} == set(LEAST)


@pytest.mark.parametrize("card", EXPERTS, ids=lambda card: card.env_id)
def test_a_shipped_expert_is_good(card: Card) -> None:
    least, whole = LEAST[card.env_id]
    assert card.measured.return_mean >= least
    assert card.measured.episodes == len(card.measured.returns) == 20
    if whole:
        assert sum(length == 1000 for length in card.measured.lengths) >= 18


def test_a_medium_policy_has_about_a_third_of_the_experts_return() -> None:
    of = {(card.env_id, card.level): card.measured.return_mean for card in shelf.cards(SHIPPED)}
    mediums = [env_id for env_id, level in of if level == "medium"]
    assert set(mediums) == {"Hopper-v5", "HalfCheetah-v5", "Walker2d-v5"}
    for env_id in mediums:
        assert 0.2 <= of[env_id, "medium"] / of[env_id, "expert"] <= 0.5


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_shipped_policy_loads_and_repeats_its_card(folder: Path) -> None:
    root = folder.parents[1]
    content = json.loads((folder / shelf.CARD).read_text())
    found = shelf.find(content["env_id"], folder.name, root)
    assert found.path == folder
    assert found.card.level == folder.name
    assert agrees_with_its_card(found.policy, found.card)


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_a_shipped_policy_with_one_weight_moved_is_refused(folder: Path, tmp_path: Path) -> None:
    moved = tmp_path / folder.parent.name / folder.name
    shutil.copytree(folder, moved)
    (moved / shelf.POLICY).unlink()
    save_policy(perturbed(load_policy(folder / shelf.POLICY)), moved / shelf.POLICY)
    env_id = json.loads((folder / shelf.CARD).read_text())["env_id"]
    with pytest.raises(UserError, match="is not the file its card describes"):
        shelf.find(env_id, folder.name, tmp_path)
