"""The same grid by processes here and on a Ray cluster started here, one worker of which is killed."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "ray_and_kill.py"


@pytest.mark.ray
def test_a_cluster_of_which_a_worker_is_killed_comes_to_the_numbers_of_the_processes() -> None:
    said = subprocess.run([sys.executable, str(SCRIPT)], capture_output=True, text=True)
    assert said.returncode == 0, said.stdout + said.stderr
    assert "its training is gone" in said.stdout
    assert "3 of 3 cells the same" in said.stdout
