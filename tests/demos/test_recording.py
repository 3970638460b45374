"""Which episodes are kept, and what the dataset says of it."""

import numpy as np
import pytest

from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos.generate import generate
from irl.demos.info import show
from irl.demos.load import load_demos
from irl.demos.players import players
from irl.demos.recording import Recorded, Recording, keep, together
from irl.envs.behaviour import Behaviour
from tests import pointmass


def episode(return_: float, terminated: bool) -> Episode:
    return Episode(np.zeros((2, 1)), np.zeros((1, 1)), np.array([return_]), terminated, not terminated)


EPISODES = [episode(5.0, False), episode(1.0, False), episode(9.0, True), episode(1.0, True)]


@pytest.mark.parametrize(
    ("how", "kept", "dropped"),
    [
        (Recording(), [0, 1, 2, 3], (0, 0)),
        (Recording(min_return=5.0), [0, 2], (2, 0)),
        (Recording(full_length=True), [0, 1], (0, 2)),
        (Recording(min_return=5.0, full_length=True), [0], (2, 1)),
    ],
)
def test_what_is_dropped_is_counted(how: Recording, kept: list[int], dropped: tuple[int, int]) -> None:
    assert keep(EPISODES, how) == (kept, Recorded(how, 4, *dropped))


def test_none_left_is_an_error_that_says_the_best() -> None:
    with pytest.raises(UserError, match=r"4 dropped for a return below 10.*best return is 9.0"):
        keep(EPISODES, Recording(min_return=10.0))


def test_of_several_datasets_what_they_share() -> None:
    one, other = Recorded(Recording(seed=1), 4, 1, 0), Recorded(Recording(), 4, 1, 0)
    assert together([one, one]) == Recorded(Recording(seed=1), 8, 2, 0)
    assert together([one, other]) is None
    assert together([one, None]) is None


WORDS = {
    "algorithm": "by hand",
    "author": "tests",
    "random_return": None,
    "expert_return": None,
    "description": "",
}
HOW = Recording(
    seed=3,
    behaviour=Behaviour(noise=0.2, random=0.1),
    subsampling_rate=20,
    min_return=-3.5,
    full_length=True,
)


def test_the_dataset_says_how_it_was_made_and_several_processes_make_the_same(tmp_path) -> None:
    act = pointmass.expert("Cliff-v0")
    more = {"root": tmp_path, "seeds": range(12), "how": HOW, **WORDS}
    heard = []
    info = generate("Cliff-v0", act, dataset_id="a-v0", on_episode=heard.append, **more)
    assert len(heard) == 12
    assert info.recorded is not None
    assert info.recorded.how == HOW
    dropped = info.recorded.dropped_for_return + info.recorded.dropped_for_length
    assert (info.recorded.played, info.episodes) == (12, 12 - dropped)
    assert 0 < dropped < 12
    assert info == show("a-v0", tmp_path)
    one = load_demos("a-v0", root=tmp_path)
    assert min(e.return_ for e in one) >= -3.5
    # all steps are kept
    assert {len(e) for e in one} == {30}
    with players(2) as play:
        generate("Cliff-v0", act, dataset_id="b-v0", play=play, **more)
    for a, b in zip(one, load_demos("b-v0", root=tmp_path), strict=True):
        assert a.seed == b.seed
        np.testing.assert_array_equal(a.action, b.action)
        np.testing.assert_array_equal(a.obs, b.obs)
