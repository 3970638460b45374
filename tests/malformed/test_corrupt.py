"""Every kind of file that is read, with bytes changed: the reader gives a value of its type, or says no.

Where a digest stands beside the file the value is the same, or it is refused.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from irl.core import state
from irl.core.config import from_json
from irl.core.errors import UserError
from irl.core.log import Logs
from irl.core.records import open_run
from irl.core.types import Episode
from irl.demos.info import DemosInfo, show
from irl.demos.load import Demos, load_demos
from irl.experiment.configs import Imitation
from irl.experiment.draw import drawn_again
from irl.policies import shelf
from irl.policies.card import Card, read_card
from irl.policies.policy import Policy, load_policy
from irl.report.folder import RunFiles, read_run
from irl.report.header import header
from irl.report.header import settings as report_settings
from irl.report.html import render
from irl.report.tables import evaluation_table
from irl.rewards.artefact import load_reward
from irl.rewards.learned import LearnedReward
from tests.experiment.conftest import DATASET, TASK
from tests.malformed.corruption import bytes_changed, json_changed
from tests.malformed.damage import foreign
from tests.malformed.table import DATA, SHELVED, SNAPSHOT

few = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow], max_examples=50
)
CHECKPOINT = "run/checkpoint/000000768"


@pytest.fixture
def whole_config(world: Path) -> Any:
    """The settings of the run, undamaged."""
    return from_json(Imitation, open_run(world / "run").config)


@contextmanager
def corrupted(path: Path, content: bytes) -> Iterator[None]:
    """Another content of a file, within the block."""
    before = path.read_bytes()
    path.write_bytes(content)
    try:
        yield
    finally:
        path.write_bytes(before)


def read(path: Path, reader: Callable[[], Any], data: st.DataObject) -> Any:
    """What the reader makes of the file with other bytes in it, None where it refuses them in one line."""
    before = path.read_bytes()
    changes = [bytes_changed(before)]
    if path.suffix == ".json":
        changes.append(json_changed(before))
    with corrupted(path, data.draw(st.one_of(changes))):
        try:
            return reader()
        except UserError:
            return None


def same(a: Any, b: Any) -> bool:
    """Equal nested states: the same types, and tensors and arrays to the bit."""
    if type(a) is not type(b):
        return False
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, torch.Tensor):
        return torch.equal(a, b)
    return np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b


@few
@given(st.data())
def test_settings(world: Path, data: st.DataObject) -> None:
    def reader() -> Any:
        return from_json(Imitation, open_run(world / "run").config)

    found = read(world / "run/config.json", reader, data)
    assert found is None or found.KIND


@few
@given(st.data())
def test_environment_and_evaluation(world: Path, data: st.DataObject) -> None:
    """The report makes a sentence of what it cannot read; it refuses nothing."""

    def reader() -> RunFiles:
        run = read_run(world / "run")
        assert header(run) + report_settings(run)
        assert evaluation_table(run.evaluation)
        return run

    for name in ("environment.json", "evaluation.json", "config.json", "metrics.jsonl"):
        assert isinstance(read(world / "run" / name, reader, data), RunFiles)


@settings(few, max_examples=8)
@given(st.data())
def test_a_whole_report(world: Path, data: st.DataObject) -> None:
    assert read(world / "run/evaluation.json", lambda: render([read_run(world / "run")]), data)


@few
@given(st.data())
def test_demonstrations(world: Path, whole_config: Any, data: st.DataObject) -> None:
    folder = open_run(world / "run")
    before = drawn_again(whole_config, folder)
    found = read(world / "run/demonstrations.json", lambda: drawn_again(whole_config, folder), data)
    assert found is None or (isinstance(found, Demos) and found.indices == before.indices)


@few
@given(st.data())
def test_metrics(world: Path, data: st.DataObject) -> None:
    def reader() -> list[dict[str, Any]]:
        folder = open_run(world / "run")
        folder.forget_rounds_after(3)
        return folder.metrics()

    found = read(world / "run/metrics.jsonl", reader, data)
    assert found is None or all(row["round"] <= 3 for row in found)


@few
@given(st.data(), st.sampled_from([state.STRUCTURE, state.ARRAYS]))
def test_checkpoint(world: Path, data: st.DataObject, name: str) -> None:
    folder, logs = world / CHECKPOINT, Logs(world / "run/checkpoint/logs")
    before = state.load(folder, logs)
    found = read(folder / name, lambda: state.load(folder, logs), data)
    assert found is None or same(found, before)


@few
@given(st.data())
def test_policy(world: Path, data: st.DataObject) -> None:
    path = world / SNAPSHOT / "policy.safetensors"
    found = read(path, lambda: load_policy(path), data)
    if found is not None:
        assert isinstance(found, Policy)
        assert found(np.zeros(found.spec.obs_dim)).shape == (found.spec.action_dim,)


@few
@given(st.data())
def test_shelved_policy(world: Path, data: st.DataObject) -> None:
    before = shelf.find(TASK).policy
    found = read(world / SHELVED / "policy.safetensors", lambda: shelf.find(TASK).policy, data)
    assert found is None or same(found.weights, before.weights)


@few
@given(st.data())
def test_card(world: Path, data: st.DataObject) -> None:
    path = world / SHELVED / "card.json"
    found = read(path, lambda: (read_card(path), shelf.cards())[0], data)
    assert found is None or isinstance(found, Card)


@few
@given(st.data(), st.sampled_from(["spec.json", "weights.safetensors"]))
def test_reward(world: Path, data: st.DataObject, name: str) -> None:
    folder = world / SNAPSHOT / "reward"
    before = load_reward(folder).net.state_dict()
    found = read(folder / name, lambda: load_reward(folder), data)
    if found is not None:
        assert isinstance(found, LearnedReward)
        assert same(found.net.state_dict(), before)


@few
@given(st.data(), st.booleans())
def test_metadata(world: Path, data: st.DataObject, digest: bool) -> None:
    with corrupted(world / DATA / "metadata.json", (world / DATA / "metadata.json").read_bytes()):
        if not digest:
            foreign(world / DATA)
        found = read(world / DATA / "metadata.json", lambda: (show(DATASET), load_demos(DATASET)), data)
    if found is not None:
        assert isinstance(found[0], DemosInfo)
        assert all(isinstance(episode, Episode) for episode in found[1])


@few
@given(st.data())
def test_data_with_a_digest(world: Path, data: st.DataObject) -> None:
    """No other byte is read, so h5py sees no damage."""
    path = world / DATA / "main_data.hdf5"
    before = path.read_bytes()
    content = data.draw(bytes_changed(before).filter(lambda content: content != before))
    with corrupted(path, content), pytest.raises(UserError, match="sha256"):
        load_demos(DATASET)


@settings(few, max_examples=150)
@given(st.data())
def test_data_of_another_recorder(world: Path, data: st.DataObject) -> None:
    """h5py itself reads these. 25,000 files damaged so ended no process and filled no memory."""
    with corrupted(world / DATA / "metadata.json", (world / DATA / "metadata.json").read_bytes()):
        foreign(world / DATA)
        found = read(world / DATA / "main_data.hdf5", lambda: load_demos(DATASET), data)
    for episode in found or ():
        assert isinstance(episode, Episode)
        assert np.isfinite(episode.obs).all()
        assert np.isfinite(episode.action).all()
