"""`irl demos generate`: what is asked of the actions, of the episodes, and of the whole shelf."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from irl.demos.info import show
from irl.demos.load import load_demos
from irl.envs.behaviour import Behaviour
from tests.experiment.conftest import TASK
from tests.learners.test_sb3_import import OLD

Command = Callable[..., None]


def test_what_is_asked_for_is_done_and_written_down(irl: Command, capsys: pytest.CaptureFixture) -> None:
    words = ("--env-id", TASK, "--datasets-root", "ds", "--seed-range", 7, 12, "--stochastic", "--seed", 2)
    disturbed = ("--action-noise", 0.1, "--random-actions", 0.2, "--subsampling-rate", 5)
    irl("demos", "generate", *words, *disturbed, "--min-return", -20, "--full-length")
    info = show("irl/pointmass/expert-v0", Path("ds"))
    assert info.recorded is not None
    how = info.recorded.how
    assert (how.seed, how.behaviour) == (2, Behaviour(stochastic=True, noise=0.1, random=0.2))
    assert (how.subsampling_rate, how.min_return, how.full_length) == (5, -20.0, True)
    assert set(info.seeds) <= set(range(7, 13))
    assert info.recorded.played == 6
    assert "dropped" in capsys.readouterr().out
    assert "0 dropped for a return below -20, 0 dropped for ending early" in info.recorded.words


def test_where_every_episode_is_dropped_nothing_is_written(
    irl: Command, capfd: pytest.CaptureFixture
) -> None:
    words = ("--env-id", TASK, "--datasets-root", "ds", "--episodes", 2, "--min-return", 1e9)
    with pytest.raises(SystemExit):
        irl("demos", "generate", *words)
    said = capfd.readouterr().err.splitlines()[-1]
    assert "none of 2 episodes is kept" in said
    assert "2 dropped for a return below 1e+09): the best return is" in said
    assert not Path("ds").exists()


def test_a_zip_is_drawn_from_the_same_way_twice(irl: Command) -> None:
    words = ("--env-id", "Hopper-v5", "--episodes", 1, "--policy", OLD, "--datasets-root", "ds")
    for name in ("a-v0", "b-v0"):
        irl("demos", "generate", *words, "--stochastic", "--dataset-id", name)
    irl("demos", "generate", *words, "--dataset-id", "c-v0")
    drawn, again, mode = (load_demos(f"{name}-v0", root="ds")[0].action for name in "abc")
    np.testing.assert_array_equal(drawn, again)
    assert np.abs(drawn[0] - mode[0]).max() > 0.01


def test_the_whole_shelf_is_demonstrated_and_what_is_there_is_kept(
    irl: Command, capsys: pytest.CaptureFixture, home: Path
) -> None:
    shelf = ("--policies-root", home / "policies", "--datasets-root", "ds", "--workers", 1)
    irl("demos", "generate", "--all", *shelf, "--episodes", 1, "--level", "expert")
    names = sorted(path.parent.name for path in Path("ds/irl").glob("*/expert-v0"))
    assert "pointmass" in names
    assert show("irl/pointmass/expert-v0", Path("ds")).episodes == 1
    capsys.readouterr()
    irl("demos", "generate", "--all", *shelf, "--episodes", 1)
    assert capsys.readouterr().out.count("is there and kept") == len(names)
