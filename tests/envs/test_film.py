"""Pictures of a task that draws them itself, by a process that has to know the task."""

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from irl.envs.film import film
from irl.envs.inherited import handed_down
from irl.envs.rollouts import rollouts
from tests import pointmass

DRAWN = """
import gymnasium as gym
import numpy as np
from tests.pointmass import PointMass

class Drawn(PointMass):
    metadata = {"render_modes": ["rgb_array"]}

    def __init__(self, render_mode=None):
        super().__init__()
        self.render_mode = render_mode

    def render(self):
        return np.zeros((60, 80, 3), np.uint8)

gym.register("Drawn-v0", Drawn, max_episode_steps=30, disable_env_checker=True)
"""


class Drawn(pointmass.PointMass):
    """What this process knows of the task of the module."""

    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012


def test_a_task_of_a_module_that_was_typed_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "drawn_task_module.py").write_text(DRAWN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    spec = EnvSpec("Drawn-v0", lambda **_: Drawn(), max_episode_steps=30, disable_env_checker=True)
    monkeypatch.setitem(gym.registry, "Drawn-v0", spec)
    (episode,) = rollouts("Drawn-v0", lambda obs: np.ones(2), [4])
    with pytest.raises(RuntimeError, match="there is no environment 'Drawn-v0'"):
        film("Drawn-v0", episode, 5, tmp_path / "sheet.webp")
    with handed_down(["drawn_task_module"]):
        written = film("Drawn-v0", episode, 5, tmp_path / "sheet.webp")
    assert (written["frames"], written["every"]) == (5, 6)
    assert (tmp_path / "sheet.webp").is_file()
