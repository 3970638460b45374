import hashlib
import json
import os
import stat
from pathlib import Path

import pytest

from irl.core import files
from irl.core.errors import UserError


def everything(folder: Path) -> dict[str, str]:
    """Every file below, hidden ones too, with its content."""
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.json"
    files.write_bytes(path, b"old and longer")
    files.write_bytes(path, b"new")
    assert everything(tmp_path) == {"new/a.json": "new"}
    assert stat.S_IMODE(path.stat().st_mode) == 0o644


@pytest.mark.parametrize("broken", ["fsync", "replace"])
@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()], ids=["full", "interrupt"])
def test_a_write_that_fails_leaves_the_old_file_and_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken: str, error: BaseException
) -> None:
    files.write_bytes(tmp_path / "a", b"old")

    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(os, broken, fail)
    with pytest.raises(type(error)):
        files.write_bytes(tmp_path / "a", b"new")
    with pytest.raises(type(error)):
        files.write_bytes(tmp_path / "b", b"new")
    assert everything(tmp_path) == {"a": "old"}


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
def test_json_has_no_nan(tmp_path: Path, number: float) -> None:
    files.write_json(tmp_path / "a.json", {"x": 1})
    with pytest.raises(ValueError, match="JSON compliant"):
        files.write_json(tmp_path / "a.json", {"x": number})
    assert files.read_json(tmp_path / "a.json") == {"x": 1}
    assert names(tmp_path) == {"a.json"}


def test_json_comes_back(tmp_path: Path) -> None:
    value = {"a": [1, 2.5, None, True], "b": {"c": "σ, 0.1"}, "d": 0.1 + 0.2}
    files.write_json(tmp_path / "a.json", value)
    assert files.read_json(tmp_path / "a.json") == value
    assert json.loads((tmp_path / "a.json").read_text()) == value


def test_json_that_cannot_be_read_is_the_users_to_mend(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    with pytest.raises(UserError, match=r"no file .*a\.json"):
        files.read_json(path)
    for content in (b'{"a": 1', b"", b"\xff\xfe\x00"):
        path.write_bytes(content)
        with pytest.raises(UserError, match=r"a\.json is not readable JSON"):
            files.read_json(path)


def test_a_folder_appears_when_its_block_has_ended(tmp_path: Path) -> None:
    with files.new_folder(tmp_path / "deep" / "a") as folder:
        (folder / "x").write_text("1")
        assert not (tmp_path / "deep" / "a").exists()
    assert everything(tmp_path) == {"deep/a/x": "1"}
    assert names(tmp_path / "deep") == {"a"}
    assert stat.S_IMODE((tmp_path / "deep" / "a").stat().st_mode) == 0o755


def test_a_folder_that_was_there_is_replaced_not_merged(tmp_path: Path) -> None:
    for name in ("old", "new"):
        with files.new_folder(tmp_path / "a") as folder:
            (folder / name).write_text(name)
    assert everything(tmp_path) == {"a/new": "new"}


@pytest.mark.parametrize("error", [RuntimeError("half way"), KeyboardInterrupt()], ids=["error", "interrupt"])
def test_a_block_that_fails_leaves_the_old_folder_and_nothing_beside_it(
    tmp_path: Path, error: BaseException
) -> None:
    with files.new_folder(tmp_path / "a") as folder:
        (folder / "x").write_text("old")

    def fill(path: Path) -> None:
        with files.new_folder(path) as folder:
            (folder / "x").write_text("new")
            raise error

    for name in ("a", "b"):
        with pytest.raises(type(error)):
            fill(tmp_path / name)
    assert everything(tmp_path) == {"a/x": "old"}
    assert names(tmp_path) == {"a"}


def test_the_checksum_is_sha256(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"abc")
    # FIPS 180-2, appendix B.1
    assert files.sha256(tmp_path / "a").startswith("ba7816bf8f01cfea414140de5dae2223")
    assert files.sha256(tmp_path / "a") == hashlib.sha256(b"abc").hexdigest()


def test_folders_made_for_what_then_failed_go_again(tmp_path: Path) -> None:
    def fill(path: Path) -> None:
        with files.new_folder(path):
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        fill(tmp_path / "a" / "b" / "c")
    assert names(tmp_path) == set()
    (tmp_path / "a").mkdir()
    with pytest.raises(RuntimeError, match="half way"):
        fill(tmp_path / "a" / "b" / "c")
    assert names(tmp_path) == {"a"}


def test_a_folder_that_cannot_take_its_place_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files.write_bytes(tmp_path / "a" / "x", b"old")
    rename, renamed = os.rename, []

    def fail_once(source: Path, target: Path) -> None:
        renamed.append(target)
        if len(renamed) == 2:
            raise OSError("no more")
        rename(source, target)

    monkeypatch.setattr(os, "rename", fail_once)
    with pytest.raises(OSError, match="no more"), files.new_folder(tmp_path / "a") as folder:
        (folder / "x").write_text("new")
    assert everything(tmp_path) == {"a/x": "old"}
    assert names(tmp_path) == {"a"}


def test_json_without_end_and_keys_that_contradict_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    os.mkfifo(path)
    with pytest.raises(UserError, match="is not a file"):
        files.read_json(path)
    path.unlink()
    for content, message in (
        ("[" * 100_000, "nested too deeply"),
        ('{"b": {"a": 1, "a": 1}}', "named twice: a"),
        ("1" * 5000, "digits"),
    ):
        path.write_text(content)
        with pytest.raises(UserError, match=message):
            files.read_json(path)


def test_room_is_tried_and_given_back(tmp_path: Path) -> None:
    files.check_room(tmp_path, 3 * 2**20 + 5)
    files.check_writable(tmp_path / "deep" / "a")
    assert names(tmp_path) == set()
