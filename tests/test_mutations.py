"""The table of known bugs still fits the code; scripts/mutations.py tries its rows, minutes long."""

import ast
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


def _script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("mutations", ROOT / "scripts" / "mutations.py")
    assert spec is not None
    assert spec.loader is not None
    sys.modules["mutations"] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


script = _script()
ROWS = script.table()


@pytest.mark.parametrize("row", ROWS, ids=[f"{row.bug} {row.what}" for row in ROWS])
def test_a_row_applies_to_one_place_and_names_a_test_that_is_there(row) -> None:
    patched = row.applied((ROOT / row.file).read_text(encoding="utf-8"))
    # still Python, so that a test fails by what it finds
    ast.parse(patched)
    file, _, name = row.test.partition("::")
    tests = {n.name for n in ast.parse((ROOT / file).read_text()).body if isinstance(n, ast.FunctionDef)}
    assert name in tests


def test_text_that_is_not_there_once_is_refused() -> None:
    row = script.Mutation(0, "", "a.py", "x = 1\n", "x = 2\n", "")
    assert row.applied("x = 1\ny = 1\n") == "x = 2\ny = 1\n"
    for text in ("y = 1\n", "x = 1\nx = 1\n"):
        with pytest.raises(ValueError, match=r"a\.py holds .* times, not once"):
            row.applied(text)


def test_a_row_is_noticed_not_noticed_or_not_tested_and_the_file_is_as_before(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("x = 1\n")
    (tmp_path / "test_a.py").write_text(
        "from a import x\n\ndef test_it():\n    assert x == 1\n\ndef test_nothing():\n    pass\n"
    )
    found = [
        script.verdict(script.Mutation(0, "", "a.py", "x = 1", new, f"test_a.py::{test}"), tmp_path)
        for new, test in (
            ("x = 2", "test_it"),
            ("x = 2", "test_nothing"),
            ("x = 2", "gone"),
            ("x =", "test_it"),
        )
    ]
    assert found[:2] == ["noticed", "NOT NOTICED"]
    assert all(verdict.startswith("NOT TESTED") for verdict in found[2:])
    assert (tmp_path / "a.py").read_text() == "x = 1\n"
