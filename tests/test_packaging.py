"""The wheel is all that somebody needs: built, installed and used away from the checkout."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

LOOK = """
import importlib.metadata, importlib.resources, json, irl
files = importlib.resources.files("irl")
metadata = importlib.metadata.distribution("irl")
print(json.dumps({
    "irl": irl.__file__,
    "typed": files.joinpath("py.typed").is_file(),
    "page": [files.joinpath("report", name).is_file() for name in ("page.css", "page.js")],
    "version": metadata.version,
    "scripts": {e.name: e.value for e in metadata.entry_points if e.group == "console_scripts"},
}))
"""

EXPERTS = """
import json
from irl.policies import shelf
shelved = [shelf.find(card.env_id, card.level) for card in shelf.cards()]
print(json.dumps([str(found.path) for found in shelved]))
"""


def run(*command: str | Path, cwd: Path, **environment: str) -> str:
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def contents(folder: Path) -> dict[str, bytes]:
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.rglob("*")) if f.is_file()}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the wheel installs, and nothing of the checkout."""
    built, target = tmp_path_factory.mktemp("built"), tmp_path_factory.mktemp("installed")
    pip = (sys.executable, "-m", "pip", "-q", "--disable-pip-version-check")
    run(*pip, "wheel", ROOT, "--no-deps", "--no-index", "--no-build-isolation", "-w", built, cwd=built)
    (wheel,) = built.glob("irl-*.whl")
    run(*pip, "install", "--no-deps", "--no-index", "--target", target, wheel, cwd=built)
    return target


def test_the_wheel_works_in_an_empty_folder(installed, tmp_path):
    found = json.loads(run(sys.executable, "-c", LOOK, cwd=tmp_path, PYTHONPATH=str(installed)))
    assert Path(found["irl"]) == installed / "irl" / "__init__.py"
    assert found["typed"]
    assert found["page"] == [True, True]
    assert found["version"] == "0.1.0"
    assert found["scripts"] == {"irl": "irl.experiment.cli:main"}


def test_the_wheel_carries_the_shipped_experts(installed):
    shelf = ROOT / "expert_data" / "policies"
    assert contents(installed / "irl" / "expert_data" / "policies") == contents(shelf)


def test_the_shelf_of_the_wheel_finds_its_experts(installed, tmp_path, monkeypatch):
    monkeypatch.delenv("IRL_POLICIES_PATH", raising=False)
    shelf = installed / "irl" / "expert_data" / "policies"
    cards = sorted(shelf.glob("*/*/card.json"))
    assert cards
    found = json.loads(run(sys.executable, "-c", EXPERTS, cwd=tmp_path, PYTHONPATH=str(installed)))
    assert sorted(found) == [str(card.parent) for card in cards]


def test_the_wheel_holds_the_package_and_nothing_else(installed):
    top = {path.name for path in installed.iterdir()}
    assert top == {"irl", "bin", "irl-0.1.0.dist-info"}
    assert not (installed / "irl" / "expert_data" / "datasets").exists()
