"""A small dataset, in a root of its own."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from irl.core.rng import stream
from irl.demos.generate import generate
from irl.demos.info import DemosInfo
from irl.demos.metadata import DIGEST
from irl.envs.make import make
from irl.envs.rollouts import random_act

Generate = Callable[..., DemosInfo]


@pytest.fixture(autouse=True)
def _no_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MINARI_DATASETS_PATH", raising=False)


@pytest.fixture
def make_hopper(tmp_path: Path) -> Generate:
    """Random actions in Hopper-v5, short episodes with every reward term."""

    def run(dataset_id: str = "irl/hopper/random-v0", **changes) -> DemosInfo:
        env = make("Hopper-v5")
        act = random_act(env.action_space, stream(0, "test"))
        env.close()
        arguments = {
            "dataset_id": dataset_id,
            "root": tmp_path,
            "seeds": [11, 12, 13, 14, 15],
            "algorithm": "random",
            "author": "somebody",
            "random_return": 20.0,
            "expert_return": 120.0,
            "description": "a test",
        }
        return generate("Hopper-v5", act, **(arguments | changes))

    return run


def foreign(data: Path, **changes: Any) -> None:
    """Make the dataset in `data` one of another recorder, who leaves no digest; then change its metadata."""
    content = json.loads((data / "metadata.json").read_text()) | changes
    content.pop(DIGEST, None)
    (data / "metadata.json").write_text(json.dumps(content))
