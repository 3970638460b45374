"""Files that would run something, were they read as anything but data: nothing of them is run."""

import functools
import io
import json
import os
import pickle
import shutil
import struct
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from minari import MinariDataset

from irl.core.errors import UserError
from irl.core.records import open_run
from irl.report.html import write_report
from tests.experiment.conftest import DATASET, LOOK, TASK
from tests.malformed.conftest import refused
from tests.malformed.damage import foreign, keyed
from tests.malformed.table import DATA, SHELVED, SNAPSHOT

Command = Callable[..., None]

SHOW, EVALUATE, RESUME = f"demos show {DATASET}", "evaluate run --episodes 1", "train --resume run"


def checkpoint() -> None:
    open_run(Path("run")).load_checkpoint()


def metrics() -> None:
    open_run(Path("run")).metrics()


def report() -> None:
    write_report(Path("run"))


READ_BY: dict[str, tuple[str | Callable[[], None], ...]] = {
    f"{DATA}/main_data.hdf5": (SHOW, f"train gail --env-id {TASK} --out new"),
    f"{DATA}/metadata.json": (SHOW, f"train gail --env-id {TASK} --out new", "demos list"),
    f"{SHELVED}/card.json": ("experts list", "experts evaluate --episodes 1", EVALUATE),
    f"{SHELVED}/policy.safetensors": ("experts evaluate --episodes 1", f"demos generate --env-id {TASK}"),
    "run/config.json": (EVALUATE, RESUME, "train --config run/config.json --out new", report),
    "run/environment.json": (report,),
    "run/demonstrations.json": (EVALUATE, RESUME),
    "run/metrics.jsonl": (metrics, report),
    "run/evaluation.json": (report,),
    f"{SNAPSHOT}/policy.safetensors": (EVALUATE,),
    f"{SNAPSHOT}/reward/spec.json": (EVALUATE,),
    f"{SNAPSHOT}/reward/weights.safetensors": (EVALUATE,),
    "run/checkpoint/000000768/state.json": (checkpoint,),
    "run/checkpoint/000000768/state.safetensors": (checkpoint,),
}
"""Every kind of file that irl reads, and what reads it: a command, or where that would go on, the reader."""


class Payload:
    """Makes the file `ran` in the current folder when it is unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (Path("ran"),)


def _saved(save: Callable[[io.BytesIO], object]) -> bytes:
    buffer = io.BytesIO()
    save(buffer)
    return buffer.getvalue()


def _header(text: str, size: int | None = None) -> bytes:
    return struct.pack("<Q", len(text) if size is None else size) + text.encode()


def _tensor(shape: list[int], offsets: list[int]) -> str:
    return json.dumps({"dtype": "F32", "shape": shape, "data_offsets": offsets})


CONTENTS = {
    "pickle": pickle.dumps(Payload()),
    "pickle of protocol 0": pickle.dumps(Payload(), protocol=0),
    "npy of objects": _saved(lambda f: np.save(f, np.array([Payload()], dtype=object), allow_pickle=True)),
    "npz of objects": _saved(lambda f: np.savez(f, w=np.array([Payload()], dtype=object))),
    "torch's own": _saved(lambda f: torch.save({"w": Payload()}, f)),
    "jsonpickle": b'{"py/reduce": [{"py/function": "os.system"}, {"py/tuple": ["touch ran"]}]}',
    "yaml": b'!!python/object/apply:os.system ["touch ran"]',
    "python": b"__import__('os').system('touch ran')",
    "deep JSON": b"[" * 200_000,
    "deep JSON objects": b'{"a":' * 200_000,
    "a huge integer": b'{"round": 1' + b"0" * 100_000 + b"}",
    "a huge exponent": b'{"round": 1e999999, "steps": -1e999999}',
    "keys twice": b'{"kind": "gail", "kind": "expert"}',
    "JSON null": b"null",
    "a header of 2^63 bytes": _header("{}", 2**63),
    "a header beyond the file": _header("{}", 99_000_000),
    "a tensor of 4 TB": _header(f'{{"a": {_tensor([2**40], [0, 2**42])}}}'),
    "a tensor that overflows": _header(f'{{"a": {_tensor([2**62, 8], [0, 0])}}}'),
    "a tensor beyond the file": _header(f'{{"a": {_tensor([1], [100, 104])}}}') + b"abcd",
    "a tensor before the file": _header(f'{{"a": {_tensor([1], [-4, 0])}}}') + b"abcd",
    "tensors that overlap": _header(f'{{"a": {_tensor([1], [0, 4])}, "b": {_tensor([1], [0, 4])}}}')
    + b"abcd",
    "a tensor twice": _header(f'{{"a": {_tensor([1], [0, 4])}, "a": {_tensor([1], [0, 4])}}}') + b"abcd",
    "a type that numpy lacks": _header('{"a": {"dtype": "F8_E4M3", "shape": [4], "data_offsets": [0, 4]}}')
    + b"abcd",
    "a header whose text is deep": _header(json.dumps({"__metadata__": {"irl": "[" * 200_000}})),
}


def attempted(run: Callable[[], None]) -> None:
    """Run it; it may do what it is for, or say what is wrong."""
    with suppress(UserError):
        try:
            run()
        except SystemExit as stopped:
            if stopped.code != 2:
                raise


@pytest.mark.parametrize("place", READ_BY)
def test_no_content_of_any_file_is_run(place: str, irl: Command, world: Path) -> None:
    for reader in READ_BY[place]:
        run = reader if callable(reader) else functools.partial(irl, *reader.split())
        for name, content in CONTENTS.items():
            (world / place).write_bytes(content)
            attempted(run)
            assert not (world / "ran").exists(), name


def test_a_pickle_that_is_loaded_does_run(world: Path) -> None:
    """The contents above are what they claim."""
    for name in ("pickle", "pickle of protocol 0"):
        pickle.loads(CONTENTS[name])
        (world / "ran").unlink()
    np.load(io.BytesIO(CONTENTS["npz of objects"]), allow_pickle=True)["w"]
    assert (world / "ran").exists()


@pytest.fixture
def evil(world: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A module that makes the file `ran` when it is imported."""
    (world / "evil.py").write_text("import pathlib\npathlib.Path('ran').touch()\n")
    monkeypatch.syspath_prepend(world)
    yield "evil:Env-v0"
    sys.modules.pop("evil", None)


NAMED = {
    "settings, to repeat": ("run/config.json", "train --config run/config.json --out new"),
    "settings, to go on": ("run/config.json", RESUME),
    "settings, to judge": ("run/config.json", EVALUATE),
    "a card": (f"{SHELVED}/card.json", "experts evaluate"),
    "a card, to demonstrate": (f"{SHELVED}/card.json", "demos generate --all --workers 1"),
    "a reward": (f"{SNAPSHOT}/reward/spec.json", EVALUATE),
}


@pytest.mark.parametrize("name", NAMED)
def test_a_module_that_a_file_names_is_not_imported(
    name: str, irl: Command, world: Path, evil: str, capfd: pytest.CaptureFixture
) -> None:
    place, words = NAMED[name]
    keyed(env_id=evil)(world / place)
    assert "evil" in refused(lambda: irl(*words.split()), capfd)
    assert not (world / "ran").exists()


@pytest.mark.parametrize(
    "words", [" ".join(("evaluate run", *LOOK)), "experts list", f"experts evaluate --env-id {TASK}"]
)
def test_a_card_of_a_module_is_in_nobodys_way_and_imports_nothing(
    words: str, irl: Command, world: Path, evil: str
) -> None:
    shutil.copytree(world / SHELVED, other := world / "policies" / "env" / "expert")
    keyed(env_id=evil)(other / "card.json")
    irl(*words.split())
    assert not (world / "ran").exists()


def test_a_module_that_a_grid_names_is_not_imported(
    irl: Command, world: Path, evil: str, capfd: pytest.CaptureFixture
) -> None:
    part = '[[part]]\nmethods = ["gail"]\nsteps = 64\n'
    Path("small.toml").write_text(f'seeds = [1]\ntasks = ["{evil}"]\ndemos = [1]\n{part}')
    assert "'evil'" in refused(lambda: irl("bench", "small.toml"), capfd)
    assert not (world / "ran").exists()


def test_a_module_that_the_user_types_or_allows_is_imported(
    irl: Command, world: Path, evil: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    refused(lambda: irl("train", "gail", "--env-id", evil), capfd)
    assert (world / "ran").exists()
    (world / "ran").unlink()
    del sys.modules["evil"]
    monkeypatch.setenv("IRL_ENV_MODULES", "other,evil")
    keyed(env_id=evil)(world / "run" / "config.json")
    refused(lambda: irl("evaluate", "run"), capfd)
    assert (world / "ran").exists()


RUNS = {"id": TASK, "entry_point": "os:system", "kwargs": {"command": "touch ran"}, "additional_wrappers": []}
WRAPPED = RUNS | {
    "entry_point": "tests.pointmass:PointMass",
    "kwargs": {},
    "additional_wrappers": [{"name": "w", "entry_point": "evil:Wrapper", "kwargs": {}}],
}
METADATA = {
    "an entry point": {"env_spec": json.dumps(RUNS)},
    "an entry point and no observation space": {"env_spec": json.dumps(RUNS), "observation_space": ...},
    "an entry point and no action space": {"env_spec": json.dumps(RUNS), "action_space": ...},
    "a wrapper and no space": {"env_spec": json.dumps(WRAPPED), "observation_space": ...},
    "an environment to evaluate in": {"eval_env_spec": json.dumps(RUNS)},
    "an id with a module": {"env_spec": json.dumps(RUNS | {"id": "evil:Env-v0"})},
    "a space by a module": {"observation_space": "evil:Env-v0"},
    "a space whose type is a module": {"observation_space": json.dumps({"type": "evil:Env-v0"})},
    "a space of objects": {
        "action_space": json.dumps({"type": "Box", "dtype": "O", "shape": [1], "low": [0], "high": ["evil"]})
    },
    "requirements": {"requirements": ["evil @ file:///tmp/evil"]},
    "a format by a path": {"data_format": "../evil"},
    "data in another place": {"data_path": "/etc", "dataset_id": "../../x-v0"},
}


@pytest.mark.parametrize("name", METADATA)
def test_nothing_that_a_dataset_names_is_run(name: str, irl: Command, world: Path, evil: str) -> None:
    foreign(world / DATA)
    keyed(**METADATA[name])(world / DATA / "metadata.json")
    for words in (SHOW, "demos list", f"train gail --env-id {TASK} --steps 0 --out new", EVALUATE):
        attempted(functools.partial(irl, *words.split()))
        assert not (world / "ran").exists()
        assert "evil" not in sys.modules


def test_minari_itself_would_run_it(world: Path) -> None:
    """The attack is real: without it the test above would show nothing."""
    keyed(**METADATA["an entry point and no action space"])(world / DATA / "metadata.json")
    with pytest.raises(TypeError, match=r"gymnasium\.Env"):
        MinariDataset(world / DATA)
    assert (world / "ran").exists()


def test_a_file_that_leads_elsewhere_is_refused_not_followed(
    irl: Command, world: Path, capfd: pytest.CaptureFixture
) -> None:
    """A run that was unpacked from an archive may hold links; what is written stays in its folder."""
    (world / "mine").write_text("mine")
    (world / "run" / "evaluation.json").unlink()
    for name in ("evaluation.json", "report.html"):
        os.symlink(world / "mine", world / "run" / name)
    with pytest.raises(SystemExit) as stopped:
        irl(*EVALUATE.split())
    assert stopped.value.code == 2
    assert "is a link to" in capfd.readouterr().err
    assert (world / "mine").read_text() == "mine"


def test_what_a_file_says_is_neither_markup_nor_obeyed_by_a_terminal(
    irl: Command, world: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    for name in ("[/x]", "[link=file:///etc/passwd]here"):
        keyed(algorithm_name=name)(world / DATA / "metadata.json")
        keyed(algorithm=name)(world / SHELVED / "card.json")
        for words in (SHOW, "experts list"):
            irl(*words.split())
            assert name in capfd.readouterr().out
    escapes = "\x1b]0;title\x07\x9b31m\u2028"
    keyed(algorithm_name=escapes)(world / DATA / "metadata.json")
    irl(*SHOW.split())
    assert all(line.isprintable() for line in capfd.readouterr().out.split("\n"))
    keyed(kind=escapes)(world / "run" / "config.json")
    assert refused(lambda: irl("evaluate", "run"), capfd).rstrip("\n").isprintable()
