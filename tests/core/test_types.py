from itertools import pairwise
from typing import Any

import jaxtyping
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from irl.core.rng import torch_stream
from irl.core.types import Episode, Transitions, concatenate, from_episodes

lengths_of_episodes = st.lists(st.integers(1, 6), min_size=1, max_size=5)
COLUMNS = ("obs", "action", "next_obs", "terminated", "truncated")
OPTIONAL = ("reward", "weight", "absorbing", "next_absorbing")


@pytest.fixture
def unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shape annotations off, as a user runs it; in a test they refuse first, with another message."""
    monkeypatch.setattr(jaxtyping.config, "jaxtyping_disable", True)


def episode(steps: int, start: float = 0.0, **changes: Any) -> Episode:
    """Observations `start`, `start + 1`, ...; the action of a step is its observation's negative."""
    count = start + np.arange(steps + 1.0)
    given = {
        "obs": np.stack([count, 2 * count], axis=1),
        "action": -count[:-1, None],
        "reward": 10 * count[:-1],
        "terminated": True,
        "truncated": False,
    }
    return Episode(**(given | changes))


def numbered(steps: int, **changes: Any) -> Transitions:
    """A batch whose every column tells which step it is of."""
    count = torch.arange(steps)
    given = {
        "obs": count[:, None].float(),
        "action": -count[:, None].float(),
        "next_obs": count[:, None].float() + 1,
        "terminated": count % 2 == 0,
        "truncated": count % 3 == 0,
        "reward": 10.0 * count.double(),
        "terms": {"term": 100.0 * count.double()},
        "weight": 1.0 + count,
        "absorbing": count % 4 == 0,
        "next_absorbing": count % 5 == 0,
    }
    return Transitions(**(given | changes))


def same(a: Transitions, b: Transitions) -> bool:
    pairs = [(getattr(a, name), getattr(b, name)) for name in (*COLUMNS, *OPTIONAL)]
    pairs += [(a.terms[name], b.terms[name]) for name in a.terms] if a.terms.keys() == b.terms.keys() else []
    return a.terms.keys() == b.terms.keys() and all(
        (x is None and y is None) or (x is not None and y is not None and torch.equal(x, y)) for x, y in pairs
    )


def rows_agree(batch: Transitions) -> bool:
    """Whether every column still speaks of the same step in every row."""
    return same(batch, numbered(1000)[batch.obs[:, 0].long()])


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"obs": np.zeros((3, 2))}, r"expected one more observation than actions: 3 != 3 \+ 1"),
        ({"action": np.zeros((0, 1))}, "at least one step, this one has 0 actions"),
        ({"reward": np.zeros(4)}, "expected one reward a step: 4 != 3"),
        ({"terms": {"ctrl": np.zeros(2)}}, "expected one ctrl a step: 2 != 3"),
        ({"infos": {"x_position": np.zeros(5)}}, "expected one x_position a step: 5 != 3"),
    ],
)
def test_an_episode_of_columns_that_do_not_fit_is_refused_with_the_numbers(changes, message) -> None:
    with pytest.raises(ValueError, match=message):
        episode(3, **changes)


def test_an_episode_says_what_it_is() -> None:
    whole = episode(3, start=1.0, seed=7)
    assert len(whole) == 3
    assert whole.return_ == 60.0
    assert repr(whole) == "Episode(3 steps, obs 2, action 1, return 60.0, terminated, seed 7)"
    assert "truncated" in repr(episode(3, terminated=False, truncated=True))
    assert "open" in repr(episode(3, terminated=False))


@given(lengths_of_episodes)
def test_the_next_observation_never_crosses_an_episodes_border(lengths: list[int]) -> None:
    batch = from_episodes([episode(n, start=100.0 * i) for i, n in enumerate(lengths)])
    step = torch.tensor([1.0, 2.0])
    assert len(batch) == sum(lengths)
    assert torch.equal(batch.next_obs, batch.obs + step)
    # in order: the first column counts up within an episode and jumps at its border
    expected = [100.0 * i + t for i, n in enumerate(lengths) for t in range(n)]
    assert batch.obs[:, 0].tolist() == expected
    assert (-batch.action[:, 0]).tolist() == expected
    assert batch.reward is not None
    assert batch.reward.tolist() == [10 * value for value in expected]


@given(st.lists(st.tuples(st.integers(1, 6), st.booleans(), st.booleans()), min_size=1, max_size=5))
def test_only_the_last_step_of_an_episode_ends_it(ends: list[tuple[int, bool, bool]]) -> None:
    batch = from_episodes([episode(n, terminated=done, truncated=cut) for n, done, cut in ends])
    assert batch.terminated.tolist() == [done and t == n - 1 for n, done, _ in ends for t in range(n)]
    assert batch.truncated.tolist() == [cut and t == n - 1 for n, _, cut in ends for t in range(n)]


def test_terms_are_kept_where_every_episode_has_them() -> None:
    first = episode(2, terms={"forward": np.array([0.1, 0.2]), "ctrl": np.zeros(2)})
    second = episode(1, terms={"survive": np.ones(1), "forward": np.array([0.3])})
    batch = from_episodes([first, second])
    assert {name: column.tolist() for name, column in batch.terms.items()} == {"forward": [0.1, 0.2, 0.3]}
    assert from_episodes([second]).terms.keys() == {"survive", "forward"}


def test_nets_read_float32_and_statistics_float64() -> None:
    batch = from_episodes([episode(2, terms={"forward": np.full(2, 0.1)})])
    assert {batch.obs.dtype, batch.action.dtype, batch.next_obs.dtype} == {torch.float32}
    assert batch.reward is not None
    assert {batch.reward.dtype, batch.terms["forward"].dtype} == {torch.float64}


def test_nothing_makes_no_batch() -> None:
    with pytest.raises(ValueError, match="at least one episode, got none"):
        from_episodes([])
    with pytest.raises(ValueError, match="at least one batch, got none"):
        concatenate([])


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("column", [*COLUMNS, *OPTIONAL, "terms"])
def test_columns_of_unequal_length_are_refused(column: str) -> None:
    short = numbered(2)
    with pytest.raises(ValueError, match=r"expected columns of one length: .*: 2[,}]"):
        numbered(3, **{column: getattr(short, column)})


@given(st.integers(1, 40), st.integers(1, 12), st.integers(0, 5))
def test_minibatches_hold_every_step_once_but_for_a_rest(n: int, size: int, seed: int) -> None:
    parts = list(numbered(n).minibatches(size, torch_stream(seed, "test")))
    drawn = [int(value) for part in parts for value in part.obs[:, 0]]
    assert [len(part) for part in parts] == [min(size, n)] * max(n // size, 1)
    assert len(set(drawn)) == len(drawn)
    assert set(drawn) <= set(range(n))
    if n % size == 0:
        assert set(drawn) == set(range(n))
    assert all(rows_agree(part) for part in parts)


def test_the_order_of_minibatches_is_the_generators() -> None:
    def order(seed: int) -> list[float]:
        parts = numbered(50).minibatches(10, torch_stream(seed, "test"))
        return [value for part in parts for value in part.obs[:, 0].tolist()]

    assert order(0) == order(0)
    assert order(0) != order(1)
    assert order(0) != sorted(order(0))


def test_a_sample_is_drawn_with_replacement_from_the_generator() -> None:
    batch = numbered(5)
    drawn = batch.sample(200, torch_stream(0, "test"))
    assert len(drawn) == 200
    assert set(drawn.obs[:, 0].tolist()) == {0.0, 1.0, 2.0, 3.0, 4.0}
    assert rows_agree(drawn)
    assert same(drawn, batch.sample(200, torch_stream(0, "test")))
    assert not same(drawn, batch.sample(200, torch_stream(1, "test")))


@pytest.mark.parametrize(
    ("index", "rows"),
    [
        (slice(1, 4), [1, 2, 3]),
        (slice(None, None, 3), [0, 3]),
        (torch.tensor([True, False, False, False, False, True]), [0, 5]),
        (torch.tensor([4, 4, 0]), [4, 4, 0]),
    ],
)
def test_indexing_takes_the_same_rows_of_every_column(index, rows) -> None:
    part = numbered(6)[index]
    assert part.obs[:, 0].tolist() == rows
    assert rows_agree(part)


@given(st.lists(st.integers(0, 20), max_size=4))
def test_pieces_concatenate_to_the_whole(cuts: list[int]) -> None:
    batch = numbered(20)
    borders = [0, *sorted(cuts), 20]
    pieces = [batch[a:b] for a, b in pairwise(borders)]
    assert same(concatenate(pieces), batch)


def test_concatenate_keeps_reward_and_terms_where_every_part_has_them() -> None:
    bare = numbered(2, reward=None, terms={})
    for parts in ([numbered(3), bare], [bare, numbered(3)]):
        joined = concatenate(parts)
        assert len(joined) == 5
        assert joined.reward is None
        assert joined.terms == {}


@pytest.mark.parametrize("name", ["weight", "absorbing", "next_absorbing"])
def test_concatenate_fills_what_a_part_does_not_say(name: str) -> None:
    bare = numbered(2, weight=None, absorbing=None, next_absorbing=None)
    said = getattr(numbered(3), name)
    meaning = torch.ones(2) if name == "weight" else torch.zeros(2, dtype=torch.bool)
    assert getattr(concatenate([bare, bare]), name) is None
    assert torch.equal(getattr(concatenate([numbered(3), bare]), name), torch.cat([said, meaning]))
    assert torch.equal(getattr(concatenate([bare, numbered(3)]), name), torch.cat([meaning, said]))


def test_every_column_moves_to_another_device() -> None:
    moved = numbered(3).to("meta")
    columns = [getattr(moved, name) for name in (*COLUMNS, *OPTIONAL)] + list(moved.terms.values())
    assert {column.device.type for column in columns} == {"meta"}
