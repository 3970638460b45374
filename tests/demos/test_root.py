"""The order in which roots are looked for, and the environment variable afterwards."""

import os
import warnings
from pathlib import Path

import pytest

import irl
from irl.demos import root as module
from irl.demos.root import VARIABLE, datasets_root, minari_at


def test_order(monkeypatch, tmp_path):
    checkout = Path(irl.__file__).resolve().parents[1]
    assert datasets_root() == checkout / "expert_data" / "datasets"
    monkeypatch.setenv(VARIABLE, "")
    assert datasets_root() == checkout / "expert_data" / "datasets"
    monkeypatch.setenv(VARIABLE, str(tmp_path / "variable"))
    assert datasets_root() == tmp_path / "variable"
    assert datasets_root(tmp_path / "given") == datasets_root(str(tmp_path / "given")) == tmp_path / "given"


def test_an_installed_package_uses_minaris_default(monkeypatch, tmp_path):
    monkeypatch.setattr(module, "__file__", str(tmp_path / "site-packages/irl/demos/root.py"))
    assert datasets_root() == Path.home() / ".minari" / "datasets"
    assert datasets_root("~/x") == Path.home() / "x"


@pytest.mark.parametrize("before", [None, "somewhere"])
def test_the_variable_is_put_back(monkeypatch, tmp_path, before):
    if before is not None:
        monkeypatch.setenv(VARIABLE, before)

    def within() -> None:
        with minari_at(tmp_path):
            assert os.environ[VARIABLE] == str(tmp_path)
            warnings.warn("use another id", UserWarning, stacklevel=1)
            raise RuntimeError

    with pytest.raises(RuntimeError):
        within()
    assert os.environ.get(VARIABLE) == before
