"""Files that other tools wrote with their own code; data/README.md says how."""

from pathlib import Path

import numpy as np
import pytest

from irl.core.types import Episode
from irl.demos.importers import import_file
from irl.demos.load import load_demos
from irl.envs.make import make
from tests import pointmass

DATA = Path(__file__).parent / "data"


def largest_error(episode: Episode, seed: int) -> float:
    """By how much the environment itself, given the actions, goes elsewhere than the episode says."""
    env = make("Hopper-v5")
    obs = [env.reset(seed=seed)[0]]
    rewards = []
    for action in episode.action:
        after, reward, *_ = env.step(action.astype(np.float32))
        obs.append(after)
        rewards.append(float(reward))
    env.close()
    return max(np.abs(np.array(obs) - episode.obs).max(), np.abs(rewards - episode.reward).max())


@pytest.mark.parametrize(
    ("name", "lengths", "terminated", "said"),
    [
        ("d4rl_collect_data", [25, 25, 25, 25, 23, 25, 2], [4], ()),
        # the last row of each is an observation only
        ("d4rl_dataset_writer", [25, 72, 22, 27], [], ("4 actions and 3 terminations are left out",)),
    ],
)
def test_d4rl(name: str, lengths: list[int], terminated: list[int], said: tuple, tmp_path: Path) -> None:
    info, notes = import_file(DATA / f"{name}.hdf5", "Hopper-v5", dataset_id="irl/d4rl-v0", root=tmp_path)
    assert (info.env_id, info.terms) == ("Hopper-v5", ())
    assert len(notes) == len(said)
    assert all(words in note for words, note in zip(said, notes, strict=True))
    demos = load_demos("irl/d4rl-v0", root=tmp_path)
    assert [len(episode) for episode in demos] == lengths
    assert [i for i, episode in enumerate(demos) if episode.terminated] == terminated
    assert all(episode.terminated != episode.truncated for episode in demos)
    # the n-th was reset with seed n, and float32 was written
    assert max(largest_error(episode, seed) for seed, episode in enumerate(demos)) < 1e-5


def test_lerobot(tmp_path: Path) -> None:
    info, notes = import_file(DATA / "lerobot.parquet", "PointMass-v0", dataset_id="a-v0", root=tmp_path)
    assert (info.episodes, info.steps) == (3, 87)
    assert "3 actions and 0 terminations are left out" in notes[0]
    for found, made in zip(load_demos("a-v0", root=tmp_path), pointmass.demonstrations(3), strict=True):
        np.testing.assert_allclose(found.obs, made.obs[:-1], atol=1e-7)
        np.testing.assert_allclose(found.action, made.action[:-1], atol=1e-7)
        np.testing.assert_allclose(found.reward, made.reward[:-1], atol=1e-7)
