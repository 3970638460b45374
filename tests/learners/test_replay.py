"""The memory against a slow one that keeps every transition as it came."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from irl.core import state
from irl.core.log import Logs
from irl.core.types import Transitions
from irl.envs.absorbing import absorb
from irl.learners.replay import Replay

O, A = 3, 2  # noqa: E741


def play(replay: Replay, steps: int, seed: int, first: int = 0) -> list[tuple[float, ...]]:
    """Random episodes of N environments; every transition as one row of numbers."""
    rng, n = np.random.default_rng(seed), replay.n_envs
    obs = rng.normal(size=(n, O))
    kept = []
    for _ in range(first, steps):
        action, own = rng.normal(size=(n, A)), rng.normal(size=n)
        end = rng.random((2, n)) < 0.2
        next_obs = rng.normal(size=(n, O))
        replay.add(obs, action, next_obs, end[0], end[1] & ~end[0], own)
        columns = (obs, action, next_obs, end[0][:, None], (end[1] & ~end[0])[:, None], own[:, None])
        kept += [tuple(row) for row in np.concatenate(columns, 1, dtype=np.float32).tolist()]
        reset = rng.normal(size=(n, O))
        obs = np.where((end[0] | end[1])[:, None], reset, next_obs)
    return kept


def flat(batch: Transitions) -> list[tuple[float, ...]]:
    assert batch.reward is not None
    ends = torch.stack([batch.terminated, batch.truncated, batch.reward], 1).float()
    return [
        tuple(row) for row in torch.cat([batch.obs, batch.action, batch.next_obs, ends], 1).numpy().tolist()
    ]


def everything(replay: Replay) -> set[tuple[float, ...]]:
    drawn = replay.sample(60 * len(replay) + 60, torch.Generator().manual_seed(0))
    return set(flat(drawn))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(n=st.integers(1, 3), capacity=st.integers(1, 12), steps=st.integers(1, 60), seed=st.integers(0, 10**6))
def test_what_is_drawn_is_the_newest_that_came(n: int, capacity: int, steps: int, seed: int) -> None:
    replay = Replay(capacity, n, O, A)
    came = play(replay, steps, seed)
    assert len(replay) >= min(capacity, len(came))
    assert everything(replay) == set(came[-len(replay) :])


def global_states() -> tuple[list[int], list[int]]:
    of_numpy = np.random.get_state(legacy=False)["state"]  # noqa: NPY002
    return torch.get_rng_state().tolist(), [*of_numpy["key"].tolist(), of_numpy["pos"]]


@pytest.mark.parametrize("absorbing", [False, True])
def test_what_is_drawn_is_the_generators_and_no_global_one_moves(absorbing: bool) -> None:
    replay = Replay(20, 2, O, A)
    play(replay, 30, seed=0)
    draw = replay.sample_absorbing if absorbing else replay.sample
    before = global_states()
    first = draw(16, torch.Generator().manual_seed(5))
    assert global_states() == before
    torch.rand(7)
    again, other = (draw(16, torch.Generator().manual_seed(seed)) for seed in (5, 6))
    assert flat(first) == flat(again) != flat(other)


def test_the_side_table_of_ends_does_not_grow_with_time() -> None:
    replay = Replay(20, 2, O, A)
    play(replay, 2000, seed=0)
    assert len(replay._ends) <= 32


@pytest.mark.parametrize("steps", [1, 4, 23])
def test_a_memory_goes_on_where_another_was(steps: int, tmp_path: Path) -> None:
    one, other = Replay(15, 2, O, A), Replay(15, 2, O, A)
    play(one, steps, seed=1)
    state.save(tmp_path / "a", one.state_dict(), Logs(tmp_path / "logs"))
    other.load_state_dict(state.load(tmp_path / "a", Logs(tmp_path / "logs")))
    assert everything(one) == everything(other)
    play(one, 9, seed=2)
    play(other, 9, seed=2)
    assert everything(one) == everything(other)
    draws = [r.sample(7, torch.Generator().manual_seed(3)) for r in (one, other)]
    assert flat(draws[0]) == flat(draws[1])


def test_a_checkpoint_writes_what_came_since_the_last_one(tmp_path: Path) -> None:
    replay, logs = Replay(100, 2, O, A), Logs(tmp_path / "logs")
    sizes = []
    for part in range(8):
        play(replay, 10, seed=part)
        state.save(tmp_path / str(part), replay.state_dict(), logs)
        sizes.append({path.name: path.stat().st_size for path in (tmp_path / "logs").iterdir()})
    new = [sorted(set(now) - set(before)) for before, now in itertools.pairwise(sizes)]
    assert [len(names) for names in new] == [1] * 7
    assert [sum(now.values()) - sum(before.values()) for before, now in itertools.pairwise(sizes)] < [
        2500
    ] * 7
    logs.drop_all_but(state.used_segments(tmp_path / "7"))
    assert len(list((tmp_path / "logs").iterdir())) == 5  # 100 of 160 rows, 20 a piece
    other = Replay(100, 2, O, A)
    other.load_state_dict(state.load(tmp_path / "7", logs))
    assert everything(other) == everything(replay)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(n=st.integers(1, 3), capacity=st.integers(2, 12), steps=st.integers(1, 60), seed=st.integers(0, 10**6))
def test_the_memory_with_an_absorbing_state_is_what_absorb_makes_of_it(
    n: int, capacity: int, steps: int, seed: int
) -> None:
    replay = Replay(capacity, n, O, A)
    play(replay, steps, seed)
    every = replay.rows(replay._places(torch.arange(len(replay))))
    slow = absorb(every)
    drawn = replay.sample_absorbing(80 * len(slow) + 200, torch.Generator().manual_seed(0))
    assert set(marked(drawn)) == set(marked(slow))
    assert drawn.absorbing is not None
    share = int(every.terminated.sum()) / len(slow)
    assert float(drawn.absorbing.float().mean()) == pytest.approx(share, abs=0.1)


def marked(batch: Transitions) -> list[tuple[float, ...]]:
    assert batch.absorbing is not None
    assert batch.next_absorbing is not None
    flags = zip(batch.absorbing.tolist(), batch.next_absorbing.tolist(), strict=True)
    return [(*row, *flag) for row, flag in zip(flat(batch), flags, strict=True)]


def test_a_million_steps_of_humanoid_take_less_than_two_gigabytes() -> None:
    # what is not written to takes no memory, so this is cheap to ask
    replay = Replay(1_000_000, 1, 348, 17)
    columns = [value for value in vars(replay).values() if isinstance(value, torch.Tensor)]
    assert sum(column.untyped_storage().nbytes() for column in columns) < 2e9
    assert sum(column.shape[-1] == 348 and len(column) > 10**6 for column in columns) == 1
