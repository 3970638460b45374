"""The scripts of scripts/benchmarks do not take one run for another."""

import json
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts" / "benchmarks"


@pytest.fixture(autouse=True)
def beside(monkeypatch: pytest.MonkeyPatch) -> None:
    """The scripts import each other by name."""
    monkeypatch.setattr(sys, "path", [str(SCRIPTS), *sys.path])


@pytest.fixture
def methods() -> ModuleType:
    return import_module("methods")


def write(file: Path, **content: Any) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(content))
    return file


def test_a_run_goes_on_where_it_was_begun_by_the_same_words_and_nowhere_else(
    methods: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[tuple[str, ...]] = []
    monkeypatch.setattr(methods, "irl", lambda *words: said.append(words))
    run, words = tmp_path / "run", ("dac", "--seed", "1", "--steps", "50")
    methods.begin_or_resume("train", run, *words)
    assert said == [("train", *words, "--out", str(run))]
    run.mkdir()
    (run / "config.json").write_text("{}")
    command = "-c train dac --seed 1 --steps 50 --out elsewhere/run"
    (run / "environment.json").write_text(json.dumps({"command": command}))
    methods.begin_or_resume("train", run, *words)
    assert said[1:] == [("train", "--resume", str(run))]
    others = (
        (*words[:-1], "60"),
        (*words, "--preset", "orsini"),
        ("dac", "--steps", "50"),
        # the same words, of other settings
        ("dac", "--seed", "50", "--steps", "1"),
        (*words, "--discriminator.mixup", "1"),
        ("dac", "--seed", "1", "--steps", "50", "--warm-start.updates", "50"),
    )
    for other in others:
        with pytest.raises(SystemExit, match="choose another --runs"):
            methods.begin_or_resume("train", run, *other)
    assert len(said) == 2


def test_places_are_not_what_a_run_is_begun_by(
    methods: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[tuple[str, ...]] = []
    monkeypatch.setattr(methods, "irl", lambda *words: said.append(words))
    write(tmp_path / "config.json")
    begun = "irl retrain there/dac-hopper-s1 --snapshot 5 --policies-root=there --out there"
    write(tmp_path / "environment.json", command=begun)
    # a name without a slash is a place as well
    for run in ("dac-hopper-s1", "/here/dac-hopper-s1"):
        methods.begin_or_resume("retrain", tmp_path, run, "--snapshot", "5", "--datasets-root", "data")
    assert said == [("retrain", "--resume", str(tmp_path))] * 2
    for other in (("here/dac-hopper-s2", "--snapshot", "5"), ("dac-hopper-s1", "--snapshot", "6")):
        with pytest.raises(SystemExit, match="choose another --runs"):
            methods.begin_or_resume("retrain", tmp_path, *other)


def test_a_result_of_other_words_is_not_taken_for_one_of_these(methods: ModuleType, tmp_path: Path) -> None:
    file = write(tmp_path / "hopper-s1.json", extra="--average")
    methods.check_settings(file, steps=5, extra="--average", algo="ppo")
    with pytest.raises(SystemExit, match="made with --extra '--average', not ''"):
        methods.check_settings(file, steps=5, extra="")


@pytest.mark.parametrize(
    ("said", "asked"),
    [
        # the settings of the run say it
        ({"env_steps": 8192, "settings": {"steps": 5000}}, (5000, 8192, 5001)),
        ({"env_steps": 8192, "steps": 5000}, (5000, 8192, 5001)),
        # of older results, the whole rounds that were played
        ({"env_steps": 8192}, (8192, 8193, 6144)),
        ({"env_steps": 8192}, (6145, 8193, 5000)),
        ({"env_steps": 8192, "extra": "--ppo.steps-per-round 4096"}, (5000, 8193, 4096)),
    ],
)
def test_a_result_of_other_steps_is_not_taken_for_one_of_these(
    methods: ModuleType, tmp_path: Path, said: dict[str, Any], asked: tuple[int, ...]
) -> None:
    file = write(tmp_path / "hopper-s1.json", **said)
    methods.check_settings(file, steps=asked[0])
    for other in asked[1:]:
        with pytest.raises(SystemExit, match=rf"made with --steps {said.get('steps', '')}.*, not {other}; "):
            methods.check_settings(file, steps=other)


def test_each_script_compares_what_its_results_are_made_by(tmp_path: Path) -> None:
    methods, retrained, switches = map(import_module, ("methods", "retrained", "switches"))
    made = {"task": "Hopper-v5", "seed": 1, "extra": "", "settings": {"steps": 5000}, "env_steps": 6144}
    write(tmp_path / "dac" / "hopper-s1.json", **made)
    asked: dict[str, Any] = {"seeds": (1,), "out": tmp_path, "runs": tmp_path}
    methods.main(methods.Settings("dac", steps=5000, **asked))
    with pytest.raises(SystemExit, match="made with --steps 5000, not 6000"):
        methods.main(methods.Settings("dac", steps=6000, **asked))
    (tmp_path / "dac-hopper-s1" / "snapshots" / "000000005").mkdir(parents=True)
    write(tmp_path / "dac-hopper-s1" / "config.json")
    write(tmp_path / "retrained" / "dac" / "hopper-s1-5.json", extra="", algo="ppo", env_steps=6144)
    retrained.main(retrained.Settings("dac", steps=5000, **asked))
    for other, why in (({"algo": "sac"}, "--algo 'ppo', not 'sac'"), ({"steps": 9000}, "--steps 6144")):
        with pytest.raises(SystemExit, match=f"made with {why}"):
            retrained.main(retrained.Settings("dac", **{"steps": 5000, **asked, **other}))
    write(
        tmp_path / "dac" / "hopper" / "mixup.json",
        **made | {"extra": "--discriminator.mixup 1", "score": 1.0},
    )
    at: dict[str, Any] = {"methods": ("dac",), "tasks": ("Hopper-v5",), "only": ("mixup",), "out": tmp_path}
    switches.main(switches.Settings(steps=5000, **at))
    for other, why in (
        ({"steps": 6000}, "--steps 5000, not 6000"),
        ({"seed": 2}, "--seed 1, not 2"),
        ({"extra": "--preset orsini"}, "--extra '--discriminator.mixup 1', not '--dis.*orsini'"),
    ):
        with pytest.raises(SystemExit, match=f"made with {why}"):
            switches.main(switches.Settings(**{"steps": 5000, **at, **other}))


def test_what_is_taken_to_other_dynamics_is_compared_by_its_steps_too(tmp_path: Path) -> None:
    transferred = import_module("transferred")
    write(
        run := tmp_path / "airl-hopper-s1" / "config.json", kind="airl", discriminator={}, env_id="Hopper-v5"
    )
    write(tmp_path / "airl-hopper-s1-mass-1.5.json", extra="", seeds=[7], env_steps=6144)
    asked: dict[str, Any] = {"runs": (run.parent,), "seeds": (7,), "steps": 5000, "out": tmp_path}
    transferred.main(transferred.Settings(**asked))
    for other, why in (({"steps": 9000}, "--steps 6144, not 9000"), ({"seeds": (8,)}, r"--seeds \[7\]")):
        with pytest.raises(SystemExit, match=f"made with {why}"):
            transferred.main(transferred.Settings(**asked | other))


def test_a_row_of_wall_clock_says_where_and_by_what_it_was_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wallclock = import_module("wallclock")
    row = {"task": "Hopper-v5", "seconds": 3.0}
    monkeypatch.setattr(wallclock, "run", lambda name, seed, *_: {**row, "name": name, "seed": seed})
    monkeypatch.setattr(wallclock, "environment", lambda _: {"machine": "new", "git_commit": "now"})
    older = {"share": 0.9, "every": 8192, "episodes": 5, "machine": "old", "git_commit": "then"}
    whole = {**older, "commit": "then", "times_shorter": 2.0}
    out = write(tmp_path / "wallclock.json", rows=[{**row, "name": "irl", "seed": 1}], **whole)
    wallclock.main(wallclock.Settings(seeds=(1, 2), out=out))
    first, second = json.loads(out.read_text())["rows"]
    assert first == {**row, "name": "irl", "seed": 1, **older}
    now = {**older, "machine": "new", "git_commit": "now", "peer_steps": 2_000_000, "threads": 1}
    assert second == {**row, "name": "irl", "seed": 2, **now}
    before = out.read_text()
    for other in ({"share": 0.5}, {"every": 1}, {"episodes": 6}, {"peer_steps": 9}):
        with pytest.raises(SystemExit, match=r"was made with --\S+ \S+, not \S+; choose another --out"):
            wallclock.main(wallclock.Settings(seeds=(3,), out=out, **other))
    assert out.read_text() == before
