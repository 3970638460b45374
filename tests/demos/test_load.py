"""What is loaded is what was recorded, in the shares that were asked for."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from irl.core.errors import UserError
from irl.core.types import Episode, from_episodes
from irl.demos.generate import generate
from irl.demos.load import Demos, check_task, load_demos, other_variant
from irl.envs.make import make


def test_round_trip(make_hopper, tmp_path):
    heard: list[Episode] = []
    make_hopper(on_episode=heard.append)
    demos = load_demos("irl/hopper/random-v0", root=tmp_path)
    assert isinstance(demos, Sequence)
    assert (demos.indices, demos.held_out, demos.held_out_indices) == ((0, 1, 2, 3, 4), (), ())
    assert (demos.env_id, demos.random_return, demos.expert_return) == ("Hopper-v5", 20.0, 120.0)
    assert demos.path == tmp_path / "irl/hopper/random-v0"
    for made, loaded in zip(heard, demos, strict=True):
        for name in ("obs", "action", "reward"):
            np.testing.assert_array_equal(getattr(made, name), getattr(loaded, name))
            assert getattr(made, name).dtype == getattr(loaded, name).dtype
        assert made.terms.keys() == loaded.terms.keys() == {"forward", "ctrl", "survive"}
        assert made.infos.keys() == loaded.infos.keys()
        for name, values in {**made.terms, **made.infos}.items():
            np.testing.assert_array_equal(values, {**loaded.terms, **loaded.infos}[name])
        ends = (made.terminated, made.truncated, made.seed)
        assert ends == (loaded.terminated, loaded.truncated, loaded.seed)
    assert set(from_episodes(demos).terms) == {"forward", "ctrl", "survive"}


def test_the_draw(make_hopper, tmp_path):
    make_hopper()

    def draw(n: int, seed: int) -> Demos:
        return load_demos("irl/hopper/random-v0", episodes=n, seed=seed, root=tmp_path)

    demos = draw(2, 0)
    assert (len(demos), len(demos.held_out)) == (2, 3)
    assert sorted(demos.indices + demos.held_out_indices) == [0, 1, 2, 3, 4]
    assert [e.seed for e in demos] == [11 + i for i in demos.indices]
    assert [e.seed for e in demos.held_out] == [11 + i for i in demos.held_out_indices]
    assert demos[0] is demos.episodes[0]
    assert demos[:1] == demos.episodes[:1]
    assert draw(2, 0).indices == demos.indices
    assert len({draw(2, seed).indices for seed in range(10)}) > 3
    assert set(demos.indices) < set(draw(3, 0).indices)
    assert draw(5, 0).indices == (0, 1, 2, 3, 4)


@pytest.mark.parametrize("n", [0, 6, -1])
def test_more_than_there_are(make_hopper, tmp_path, n):
    make_hopper()
    with pytest.raises(UserError, match=f"^{n} demonstration episodes asked for, .* has 5"):
        load_demos("irl/hopper/random-v0", episodes=n, root=tmp_path)


def balance(obs: np.ndarray) -> np.ndarray:
    """Keep the pole of InvertedPendulum up: a linear controller, mean return 1000."""
    return np.array([obs @ np.array([1.0, 20.0, 1.0, 2.0])]) / 3


def test_a_linear_controller_gives_whole_episodes(tmp_path):
    info = generate(
        "InvertedPendulum-v5",
        balance,
        dataset_id="irl/invertedpendulum/expert-v0",
        root=tmp_path,
        seeds=[0],
        algorithm="a linear controller",
        author="somebody",
        random_return=6.0,
        expert_return=1000.0,
        description="a test",
    )
    assert info.return_mean == info.steps == 1000
    (episode,) = load_demos("irl/invertedpendulum/expert-v0", root=tmp_path)
    assert (episode.terminated, episode.truncated) == (False, True)


def test_demonstrations_of_another_task(make_hopper, tmp_path):
    make_hopper()
    demos = load_demos("irl/hopper/random-v0", root=tmp_path)
    hopper, cheetah = make("Hopper-v5"), make("HalfCheetah-v5")
    check_task(demos, hopper)
    with pytest.raises(UserError) as caught:
        check_task(demos, cheetah)
    assert str(caught.value) == (
        "demonstrations of Hopper-v5 have observations of 11 and actions of 3; HalfCheetah-v5 has 17 and 6"
    )
    hopper.close()
    cheetah.close()


def test_another_task_of_the_same_shapes():
    episode = Episode(np.zeros((2, 17)), np.zeros((1, 6)), np.zeros(1), terminated=False, truncated=True)
    env = make("HalfCheetah-v5")
    for env_id, refused in (("Walker2d-v5", True), ("HalfCheetah-v5", False), ("MyCheetah-v0", False)):
        demos = _demos(episode, env_id)
        if refused:
            with pytest.raises(UserError, match="of Walker2d-v5 are not of HalfCheetah-v5"):
                check_task(demos, env)
        else:
            check_task(demos, env)
    env.close()


def test_another_version_of_a_task_is_said():
    episode = Episode(np.zeros((2, 17)), np.zeros((1, 6)), np.zeros(1), terminated=False, truncated=True)
    env = make("HalfCheetah-v5")
    assert other_variant(_demos(episode, "HalfCheetah-v5"), env) is None
    assert other_variant(_demos(episode, None), env) is None
    line = other_variant(_demos(episode, "HalfCheetah-v4"), env)
    assert line == (
        "demonstrations x-v0 are of HalfCheetah-v4, training is in HalfCheetah-v5; where that is not meant, "
        "name other demonstrations with --demos"
    )
    env.close()


def _demos(episode: Episode, env_id: str | None) -> Demos:
    return Demos((episode,), (), (0,), (), "x-v0", env_id, Path(), None, None, env_id)


def test_actions_are_held_against_the_bounds_as_float32_stores_them():
    env = make("Humanoid-v5")
    low, high = (np.float64(bound) for bound in (-0.4, 0.4))
    size = 348, 17

    def with_action(value: float) -> Demos:
        action = np.zeros((1, size[1]))
        action[0, 3] = value
        episode = Episode(np.zeros((2, size[0])), action, np.zeros(1), terminated=False, truncated=True)
        return _demos(episode, "Humanoid-v5")

    # 0.4 is not a float32, and a squashed action is scaled to it in a few roundings
    for value in (low, high, float(np.float32(high)), high + 1e-7, low - 1e-7):
        check_task(with_action(value), env)
    for value in (high + 1e-5, low - 1e-5, 1.0):
        with pytest.raises(
            UserError, match=r"episode 0 has the action .* column 3 at step 0; .* -0.4 to 0.4"
        ):
            check_task(with_action(value), env)
    env.close()
