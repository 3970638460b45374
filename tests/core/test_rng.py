import random
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path

import jaxtyping
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from irl.core import config, files, provenance, records, state, statistics
from irl.core.nets import fitted_normaliser, mlp
from irl.core.rng import episode_seeds, stream, torch_stream
from irl.core.types import Episode, concatenate, from_episodes

# all that the package asks for
PURPOSES = (
    "training",
    "evaluation while training",
    "evaluation",
    "probe",
    "card",
    "demonstrations",
    "random policy",
)


def draws(seed: int, name: str) -> list[float]:
    return stream(seed, name).random(4).tolist()


def torch_draws(seed: int, name: str) -> list[float]:
    return torch.rand(4, generator=torch_stream(seed, name)).tolist()


@contextmanager
def global_state_untouched() -> Iterator[None]:
    def states() -> tuple[object, ...]:
        name, keys, *rest = np.random.get_state()  # noqa: NPY002 (the state that must not move)
        assert isinstance(keys, np.ndarray)
        return random.getstate(), name, keys.tolist(), rest, torch.get_rng_state().tolist()

    before = states()
    yield
    assert states() == before


def test_a_stream_is_the_generator_of_its_seed_and_the_checksum_of_its_name() -> None:
    sequence = np.random.SeedSequence(3, spawn_key=(zlib.crc32(b"discriminator"),))
    assert draws(3, "discriminator") == np.random.default_rng(sequence).random(4).tolist()


@pytest.mark.parametrize("draw", [draws, torch_draws])
def test_the_same_arguments_give_the_same_draws_and_others_give_others(draw) -> None:
    assert draw(0, "a") == draw(0, "a")
    found = [tuple(draw(seed, name)) for seed in range(4) for name in ("a", "b", "ab")]
    assert len(set(found)) == len(found)


def test_another_stream_in_between_moves_nothing() -> None:
    alone = stream(0, "policy")
    expected = [alone.random() for _ in range(6)]
    watched, found = stream(0, "policy"), []
    for i in range(6):
        stream(0, f"new stream {i}").random(100)
        torch.rand(100, generator=torch_stream(0, "policy"))
        found.append(watched.random())
    assert found == expected


@pytest.mark.parametrize("make", [stream, torch_stream, lambda seed, name: episode_seeds(seed, name, 2)])
def test_a_negative_seed_is_refused(make) -> None:
    with pytest.raises(ValueError, match="negative"):
        make(-1, "a")


@given(st.integers(0, 2**40), st.sampled_from(PURPOSES), st.integers(0, 200))
def test_episode_seeds_are_distinct_reset_seeds(seed: int, purpose: str, n: int) -> None:
    seeds = episode_seeds(seed, purpose, n)
    assert len(set(seeds)) == len(seeds) == n
    assert all(0 <= value < 2**31 for value in seeds)
    assert seeds == episode_seeds(seed, purpose, n)


@pytest.mark.parametrize("seed", range(10))
def test_no_two_purposes_share_an_episode(seed: int) -> None:
    found = {purpose: set(episode_seeds(seed, purpose, 64)) for purpose in PURPOSES}
    shared = {(a, b): found[a] & found[b] for a, b in combinations(PURPOSES, 2)}
    assert not any(shared.values())


def test_runs_of_other_seeds_train_on_other_episodes() -> None:
    found = [value for seed in range(50) for value in episode_seeds(seed, "training", 16)]
    assert len(set(found)) == len(found)


def test_core_leaves_the_global_random_state_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # the shape checks that tests run under draw from python's own generator
    monkeypatch.setattr(jaxtyping.config, "jaxtyping_disable", True)
    with global_state_untouched():
        generator = torch_stream(0, "test")
        numbers = stream(0, "test").normal(size=(8, 3))
        episode = Episode(numbers, numbers[1:], numbers[1:, 0], True, False)
        batch = concatenate([from_episodes([episode]), from_episodes([episode])])
        list(batch.minibatches(4, generator))
        batch.sample(3, generator)
        mlp((3, 5, 1), "tanh", generator)(fitted_normaliser(batch.obs)(batch.obs))
        statistics.spearman(numbers[:, 0], numbers[:, 1])
        statistics.auroc(numbers[:, 0], numbers[:, 1])
        run = records.create(tmp_path / "run", config.to_json({"a": 1}), provenance.environment("test"))
        run.append({"round": 1.0})
        run.save_checkpoint(1, {"generator": generator.get_state()})
        with run.snapshot(1) as folder:
            files.write_json(folder / "a.json", episode_seeds(0, "test", 5))
        run.load_checkpoint()
        state.save(tmp_path / "state", [batch.obs])
        state.load(tmp_path / "state")


@pytest.mark.parametrize(
    "draw",
    [random.random, lambda: np.random.rand(), lambda: torch.rand(1)],  # noqa: NPY002
    ids=["random", "numpy", "torch"],
)
def test_the_check_of_the_global_state_sees_one_draw(draw) -> None:
    with pytest.raises(AssertionError), global_state_untouched():
        draw()
