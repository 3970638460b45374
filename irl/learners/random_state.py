"""The global random states that SB3 draws from: its actions, its minibatches."""

import random
from typing import Any

import numpy as np
import torch


def read_global() -> dict[str, Any]:
    """Where python's, numpy's and torch's global generators are."""
    cuda = torch.cuda.get_rng_state_all() if torch.cuda.is_available() else []
    return {
        "python": random.getstate(),
        "numpy": np.random.get_state(),
        "torch": torch.get_rng_state(),
        "cuda": cuda,
    }


def write_global(state: dict[str, Any]) -> None:
    """Put them there again."""
    random.setstate(state["python"])
    np.random.set_state(state["numpy"])
    torch.set_rng_state(state["torch"])
    if state["cuda"]:
        torch.cuda.set_rng_state_all(state["cuda"])
