import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tests.pointmass  # noqa: F401 (registers PointMass-v0)
from irl.core.errors import UserError
from irl.core.types import Episode
from irl.policies.card import (
    Card,
    Measurement,
    measure,
    measure_random,
    normalised_score,
    read_card,
    summary,
    write_card,
)

# other tools read these
FIXED = {
    "env_id",
    "algorithm",
    "steps",
    "seed",
    "return_mean",
    "return_std",
    "return_min",
    "return_max",
    "length_min",
    "episodes",
    "random_return_mean",
    "weights_sha256",
}


def episode(rewards: list[float], seed: int) -> Episode:
    n = len(rewards)
    return Episode(np.zeros((n + 1, 1)), np.zeros((n, 1)), np.array(rewards), True, False, seed=seed)


EPISODES = [episode([1.0, 2.0], 7), episode([5.0], 8), episode([0.0, 0.0, 1.0], 9)]

CARD = Card(
    env_id="Hopper-v5",
    level="expert",
    algorithm="ppo",
    steps=1000,
    seed=0,
    measured=summary(EPISODES),
    random_return_mean=0.1 + 0.2,
    random_return_std=1.0,
    settings={"lr": 3e-4, "hidden": [64, 64]},
    versions={"torch": "2"},
    command="irl experts train --env-id Hopper-v5",
    weights_sha256="ab" * 32,
)


def test_a_measurement_is_of_whole_episodes() -> None:
    assert CARD.measured == Measurement(
        return_mean=3.0,
        return_std=float(np.std([3.0, 5.0, 1.0])),
        return_min=1.0,
        return_max=5.0,
        length_mean=2.0,
        length_min=1,
        episodes=3,
        returns=(3.0, 5.0, 1.0),
        lengths=(2, 1, 3),
        episode_seeds=(7, 8, 9),
    )


def test_the_deviation_is_over_episodes() -> None:
    assert CARD.measured.return_std == pytest.approx(math.sqrt(8 / 3), rel=1e-12)


def test_a_card_comes_back_as_it_was(tmp_path: Path) -> None:
    write_card(CARD, tmp_path / "card.json")
    assert read_card(tmp_path / "card.json") == CARD
    other = replace(CARD, seed=5, measured=summary(EPISODES[:1]))
    write_card(other, tmp_path / "card.json")
    assert read_card(tmp_path / "card.json") == other


def test_a_card_that_says_nothing_of_its_training_time_is_read(tmp_path: Path) -> None:
    path = tmp_path / "card.json"
    write_card(replace(CARD, train_s=12.5), path)
    assert read_card(path).train_s == 12.5
    content = json.loads(path.read_text())
    del content["train_s"]
    path.write_text(json.dumps(content))
    assert read_card(path) == CARD


def test_the_file_is_flat_and_has_the_names_that_others_rely_on(tmp_path: Path) -> None:
    write_card(CARD, tmp_path / "card.json")
    content = json.loads((tmp_path / "card.json").read_text())
    assert set(content) >= FIXED
    assert "measured" not in content
    assert all(isinstance(content[name], str | int | float) for name in FIXED)
    assert content["return_mean"] == 3.0
    assert content["returns"] == [3.0, 5.0, 1.0]


@pytest.mark.parametrize("name", [*sorted(FIXED), "returns", "lengths", "episode_seeds", "settings", "level"])
def test_a_missing_field_is_named(tmp_path: Path, name: str) -> None:
    path = tmp_path / "card.json"
    write_card(CARD, path)
    content = json.loads(path.read_text())
    del content[name]
    path.write_text(json.dumps(content))
    with pytest.raises(UserError, match=rf"card\.json is not a policy card: it lacks {name}$"):
        read_card(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steps": "many"}, r"card\.json\.steps: expected int, found 'many'"),
        ({"return_mean": None}, r"measured\.return_mean: expected float, found None"),
        ({"returns": [1.0, "x"]}, r"measured\.returns\[1\]: expected float"),
    ],
)
def test_a_field_of_the_wrong_type_is_named(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    path = tmp_path / "card.json"
    write_card(CARD, path)
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
    with pytest.raises(UserError, match=message):
        read_card(path)


@pytest.mark.parametrize("content", ["[]", "{}", "7"])
def test_other_json_is_no_card(tmp_path: Path, content: str) -> None:
    (tmp_path / "card.json").write_text(content)
    with pytest.raises(UserError, match="is not a policy card: it lacks algorithm, command, env_id"):
        read_card(tmp_path / "card.json")


def test_a_field_of_a_later_version_is_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "card.json"
    write_card(CARD, path)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"later": 1}))
    assert read_card(path) == CARD


reference = st.floats(-1e4, 1e4)


@given(reference, reference, st.floats(-3, 3))
def test_a_score_is_0_for_random_1_for_the_expert_and_linear_between(
    random: float, expert: float, share: float
) -> None:
    if abs(expert - random) < 1e-3:
        return
    value = random + share * (expert - random)
    assert normalised_score(value, random, expert) == pytest.approx(share, abs=1e-6)
    assert normalised_score(random, random, expert) == 0.0
    assert normalised_score(expert, random, expert) == 1.0


def test_without_two_references_there_is_no_score() -> None:
    assert math.isnan(normalised_score(1.0, None, 2.0))
    assert math.isnan(normalised_score(1.0, 0.0, None))
    assert math.isnan(normalised_score(1.0, 2.0, 2.0))


def test_the_zero_of_the_score_is_the_same_every_time() -> None:
    first = measure_random("PointMass-v0", 3)
    np.random.rand(5)  # noqa: NPY002 (must not matter)
    assert measure_random("PointMass-v0", 3) == first
    assert first.lengths == (30, 30, 30)
    assert len(set(first.returns)) == 3


def test_a_policy_is_measured_in_the_episodes_asked_for() -> None:
    seen: list[Episode] = []
    measured = measure("PointMass-v0", lambda obs: np.zeros(2), [3, 4], seen.append)
    assert measured.episode_seeds == (3, 4) == tuple(episode.seed for episode in seen)
    assert measured.returns == tuple(episode.return_ for episode in seen)
    # standing still earns minus the distance from the origin, every step
    expected = [-float(np.linalg.norm(episode.obs[1:], axis=1).sum()) for episode in seen]
    assert measured.returns == pytest.approx(expected, rel=1e-12)
