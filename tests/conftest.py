"""What every test starts from: one thread, no display, and global random states of its own.

irl draws from named streams, but SB3 and torch's initialisers draw from global ones.
"""

import os
import random

# MuJoCo looks for a display at its first import otherwise; no test renders.
os.environ.setdefault("MUJOCO_GL", "disable")

import numpy as np
import pytest
import torch
from hypothesis import settings

torch.set_num_threads(1)

# No deadline: the first call of a shape-checked function is slow. Derandomised: a red run stays red.
settings.register_profile("irl", deadline=None, derandomize=True)
settings.load_profile("irl")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    random.seed(0)
    np.random.seed(0)  # noqa: NPY002 (SB3 draws from it)
    torch.manual_seed(0)
