"""What is drawn on the probe: of a reward that is the hand-written one, shaped, the answers are known."""

import json
from typing import Any

import numpy as np
import pytest

from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import stream
from irl.core.types import Episode
from irl.diagnostics import compare, val
from irl.diagnostics.stack import stack
from irl.experiment.pictured import pictures


def played(name: str, seed: int) -> Episode:
    rng = stream(seed, name)
    obs, action = rng.normal(size=(61, 3)), rng.normal(size=(60, 2))
    terms = {"forward": obs[1:, 0], "ctrl": -0.3 * np.sum(action**2, axis=1)}
    return Episode(
        obs=obs,
        action=action,
        reward=terms["forward"] + terms["ctrl"],
        terminated=False,
        truncated=True,
        terms=terms,
        infos={},
        seed=seed,
    )


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    base = ProbeSet("X-v0", {name: tuple(played(name, i) for i in range(4)) for name in ("expert", "random")})
    steps = stack(base)
    truth = steps.batch.reward
    assert truth is not None
    hand_written = truth.double().numpy()
    noise = stream(0, "noise").normal(size=len(hand_written))
    rewards = np.column_stack([noise, 3.0 * hand_written + 1.0])
    of = compare.columns(hand_written, rewards, steps, 0.99, 0)
    asked = {0: lambda batch: batch.obs[:, 0], 100: lambda batch: batch.obs[:, 1]}
    return pictures(val.canonical(of, 0), base, asked, steps.batch, 10, 0)


def test_the_map_has_the_truth_at_its_end(found: dict[str, Any]) -> None:
    one = found["maps"][0]
    assert one["n"] == 1
    assert np.shape(one["matrix"]) == (3, 3)
    assert one["matrix"][1][2] == pytest.approx(0.0, abs=1e-6)
    assert one["matrix"][0][2] > 0.5
    assert found["maps"][3]["reason"] == "segments of 100 steps fit into 0 of 8 episodes"


def test_the_lines_have_the_slope_of_the_scale(found: dict[str, Any]) -> None:
    for unit in ("step", "segment"):
        for row in found["against"][unit]["strata"].values():
            assert row["slope"] == pytest.approx(3.0, rel=1e-4)
            assert sum(row["hex_count"]) == row["size"]


def test_the_fan_has_the_quantiles_of_each_kind_of_play(found: dict[str, Any]) -> None:
    assert set(found["fan"]["strata"]) == {"expert", "random", "final policy"}
    for levels in found["fan"]["strata"].values():
        assert np.all(np.diff(levels, axis=0) >= 0)


def test_the_terms_are_those_of_the_truth(found: dict[str, Any]) -> None:
    weights = found["terms"]["weights"]
    assert weights["ctrl"]["weight"][1] == pytest.approx(3.0, rel=0.05)
    assert found["terms"]["explained"][1] == pytest.approx(1.0, abs=0.01)
    assert abs(found["terms"]["explained"][0]) < 0.2


def test_it_is_json_without_gaps(found: dict[str, Any]) -> None:
    json.dumps(found, allow_nan=False)
    assert found["residuals"] is None or len(found["residuals"]["rows"]) <= 12
