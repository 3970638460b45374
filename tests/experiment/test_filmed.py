"""Episodes for the report: which are taken, what is written of them, and where there is no picture."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from irl.core.types import Episode
from irl.envs import film
from irl.experiment import filmed
from tests import pointmass  # noqa: F401, registers the task


def episode(return_: float, seed: int = 0) -> Episode:
    reward = np.array([return_ - 1.0, 1.0])
    return Episode(
        obs=np.zeros((3, 2)), action=np.zeros((2, 1)), reward=reward, terminated=False, truncated=True,
        terms={"all": reward}, infos={}, seed=seed,
    )  # fmt: skip


def learned(batch: object) -> torch.Tensor:
    return torch.tensor([0.5, 0.25])


def test_the_episode_in_the_middle_and_the_worst_are_taken(tmp_path: Path) -> None:
    episodes = [episode(3.0, 1), episode(9.0, 2), episode(1.0, 3)]
    middle, worst = filmed.record(tmp_path, "PointMass-v0", episodes, learned, 0)
    assert (middle["name"], middle["seed"], middle["return"]) == ("middle", 1, 3.0)
    assert (worst["name"], worst["seed"]) == ("worst", 3)
    assert middle["learned"] == [0.5, 0.25]
    assert middle["hand_written"] == middle["terms"]["all"] == [2.0, 1.0]
    assert middle["film_reason"] == "none was asked for: --frames 0"
    assert list(tmp_path.iterdir()) == []


def test_one_episode_is_both(tmp_path: Path) -> None:
    assert len(filmed.record(tmp_path, "PointMass-v0", [episode(3.0)], learned, 0)) == 1


def test_a_task_that_draws_nothing_is_said_to(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="draws no pictures"):
        film.film("PointMass-v0", episode(1.0), 5, tmp_path / "x.webp")


def test_a_library_that_is_missing_ends_no_evaluation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*words: object, **more: object) -> SimpleNamespace:
        return SimpleNamespace(returncode=-11, stdout="", stderr="\nImportError: no GL\n")

    monkeypatch.setattr(film.subprocess, "run", broken)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    found = filmed._filmed(tmp_path, "Hopper-v5", "middle", episode(1.0), 5)
    assert found["film"] is None
    assert found["film_reason"] == "no picture could be drawn with MUJOCO_GL=egl: ImportError: no GL"
    assert list((tmp_path / filmed.FOLDER).iterdir()) == []
