"""The scripts of scripts/benchmarks do not take one run for another."""

import json
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts" / "benchmarks"


@pytest.fixture
def methods(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setattr(sys, "path", [str(SCRIPTS), *sys.path])
    return import_module("methods")


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
    for other in ((*words[:-1], "60"), (*words, "--preset", "orsini"), ("dac", "--steps", "50")):
        with pytest.raises(SystemExit, match="choose another --runs"):
            methods.begin_or_resume("train", run, *other)
    assert len(said) == 2


def test_a_result_of_other_words_is_not_taken_for_one_of_these(methods: ModuleType, tmp_path: Path) -> None:
    file = tmp_path / "hopper-s1.json"
    file.write_text(json.dumps({"extra": "--average"}))
    methods.check_extra(file, "--average")
    with pytest.raises(SystemExit, match="made with --extra '--average', not ''"):
        methods.check_extra(file, "")
