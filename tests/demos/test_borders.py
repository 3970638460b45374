"""Flags, episodes and steps of a file say something of each row, or are refused."""

import numpy as np
import pytest

from irl.core.errors import UserError
from irl.demos.borders import split_episodes
from irl.demos.sources import Source

NAN, INF = np.nan, np.inf


def source(**arrays: object) -> Source:
    """Six steps, each with its next observation."""
    rows = np.arange(7.0)[:, None]
    steps = {"obs": rows[:-1], "next_obs": rows[1:], "rewards": np.zeros(6)}
    return Source(steps | {name: np.asarray(values) for name, values in arrays.items()})


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        (
            {"terminated": [NAN] * 5 + [1]},
            r"it has nan in row 0 of terminated \(the array terminals or terminations or terminated\); "
            r"expected 0 or 1 for each step",
        ),
        ({"terminated": [0, 0, -1, 0, 0, 1]}, "it has -1 in row 2 of terminated .*expected 0 or 1"),
        ({"terminated": [0, 0, 0, 0, 0, 1], "truncated": [0, 2, 0, 0, 0, 0]}, "has 2 in row 1 of truncated"),
        ({"truncated": [0, 0, 0, 0.5, 0, 1]}, "has 0.5 in row 3 of truncated"),
        ({"starts": [1, 0, 0, 0, NAN, 0]}, r"has nan in row 4 of starts \(the array episode_starts\)"),
        ({"starts": [1, 0, 0, 0, INF, 0]}, "has inf in row 4 of starts"),
        (
            {"episode": [0, 0, NAN, NAN, 1, 1]},
            "has nan in row 2 of episode .*episode_ids.*; expected a finite number for each step",
        ),
        ({"episode": [0, 0, 0, INF, INF, INF]}, "has inf in row 3 of episode"),
        ({"episode": [0, 0, 1, 1, 2, 2], "step": [0, NAN, 0, 1, 0, 1]}, "has nan in row 1 of step"),
        ({"terminated": [[0], [0], [NAN], [0], [0], [1]]}, "has nan in row 2, column 0, of terminated"),
    ],
)
def test_what_says_nothing_of_a_row_is_named(arrays: dict[str, list[float]], said: str) -> None:
    with pytest.raises(UserError, match=said):
        split_episodes(source(**arrays))


@pytest.mark.parametrize("kind", [bool, np.uint8, np.int64, np.float32])
def test_zeros_and_ones_of_any_kind_are_flags(kind: type) -> None:
    flags = {
        "terminated": np.array([0, 1, 0, 0, 0, 0], kind),
        "truncated": np.array([0, 0, 0, 0, 1, 0], kind),
    }
    episodes = split_episodes(source(**flags)).episodes
    assert [len(columns.rewards) for columns in episodes] == [2, 3, 1]
    assert [bool(columns.terminations[-1]) for columns in episodes] == [True, False, False]
    assert [bool(columns.truncations[-1]) for columns in episodes] == [False, True, False]


def test_episodes_may_have_any_finite_number() -> None:
    episodes = split_episodes(source(episode=[-1.5, -1.5, 7, 7, 7, 0], step=[3, 4, 0, 1, 2, 9])).episodes
    assert [len(columns.rewards) for columns in episodes] == [2, 3, 1]


def test_a_flag_of_episodes_of_one_length_is_named_where_it_stands() -> None:
    steps = {"obs": np.zeros((2, 4, 1)), "actions": np.zeros((2, 3, 1))}
    with pytest.raises(UserError, match="has nan in row 1 of terminated"):
        split_episodes(Source(steps | {"terminated": np.array([0.0, NAN])}))
    with pytest.raises(UserError, match="has nan in row 1, column 2, of truncated"):
        split_episodes(Source(steps | {"truncated": np.array([[0.0, 0, 1], [0, 0, NAN]])}))


def test_rewards_that_were_not_recorded_stay() -> None:
    found = split_episodes(source(truncated=[0, 0, 1, 0, 0, 1], rewards=np.full(6, NAN)))
    assert [np.isnan(columns.rewards).all() for columns in found.episodes] == [True, True]
