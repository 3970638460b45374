import json
from pathlib import Path

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from irl.core.errors import UserError
from irl.core.metrics import DECLARED
from irl.core.records import KEPT_CHECKPOINTS, RunFolder, create, open_run, snapshot_steps


@pytest.fixture
def run(tmp_path: Path) -> RunFolder:
    return create(tmp_path / "run", {"kind": "gail", "seed": 0}, {"python": "3"})


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_new_run_says_what_it_will_do(run: RunFolder) -> None:
    assert names(run.path) == ["config.json", "environment.json"]
    assert run.config == {"kind": "gail", "seed": 0}
    assert json.loads((run.path / "environment.json").read_text()) == {"python": "3"}
    assert open_run(run.path).config == run.config
    assert (run.metrics(), run.snapshots(), run.load_checkpoint()) == ([], {}, (None, []))


def test_a_used_folder_is_refused_and_left_alone(run: RunFolder, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"already holds a run; choose another .*--out.*--resume"):
        create(run.path, {"seed": 1}, {})
    assert run.config["seed"] == 0
    other = tmp_path / "other"
    other.mkdir()
    (other / "letter.txt").write_text("dear")
    for taken in (other, other / "letter.txt"):
        with pytest.raises(UserError, match="already holds other files"):
            create(taken, {}, {})
    assert names(other) == ["letter.txt"]


def test_an_empty_folder_is_free(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    assert create(tmp_path / "run", {"seed": 4}, {}).config == {"seed": 4}


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"holds no run: there is no .*config\.json"):
        open_run(tmp_path)


def test_where_a_run_goes_on_by_other_code_is_written_down(run: RunFolder) -> None:
    made_by = {"python": "3", "git_commit": "a", "command": "irl train --resume run"}
    for step, commit in ((10, "a"), (20, "a"), (30, "b"), (40, "a")):
        run.goes_on(step, {**made_by, "git_commit": commit})
    path = run.path / "environment.json"
    assert json.loads(path.read_text()) == {
        "python": "3",
        "resumed": [
            {"env_steps": 10, "git_commit": "a"},
            {"env_steps": 30, "git_commit": "b"},
            {"env_steps": 40, "git_commit": "a"},
        ],
    }
    path.write_text('{"resumed": 3}')
    with pytest.raises(UserError, match=r"environment\.json is not one that a run writes"):
        run.goes_on(50, made_by)
    path.unlink()
    run.goes_on(50, made_by)
    assert not path.exists()


def test_rows_come_back_in_order(run: RunFolder) -> None:
    rows = [{"round": i, "env_steps": 10 * i, "return_mean": i / 3} for i in range(1, 4)]
    for row in rows:
        run.append(row)
    assert run.metrics() == rows


def test_an_undeclared_metric_is_refused(run: RunFolder) -> None:
    run.append({"round": 1})
    with pytest.raises(KeyError, match="surprise"):
        run.append({"round": 2, "surprise": 1.0})
    assert run.metrics() == [{"round": 1}]


def test_every_metric_is_declared_with_meaning_and_unit() -> None:
    assert all(meaning and unit for meaning, unit in DECLARED.values())


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf"), None])
def test_what_is_no_number_is_null(run: RunFolder, number: float | None) -> None:
    run.append({"round": 1, "return_mean": number})
    (line,) = (run.path / "metrics.jsonl").read_text().splitlines()
    # a reader that knows only JSON, which has no NaN
    assert json.loads(line, parse_constant=pytest.fail) == {"round": 1, "return_mean": None}


def test_a_last_line_that_was_cut_off_is_none(run: RunFolder) -> None:
    run.append({"round": 1})
    whole = (run.path / "metrics.jsonl").read_text()
    for length in range(1, len(whole) - 1):
        (run.path / "metrics.jsonl").write_text(whole + whole[:length])
        assert run.metrics() == [{"round": 1}]


def test_rounds_that_will_be_played_again_are_forgotten(run: RunFolder) -> None:
    for i in range(1, 6):
        run.append({"round": i, "env_steps": 10 * i})
    with (run.path / "metrics.jsonl").open("a") as file:
        file.write('{"round": 6, "env_st')
    run.forget_rounds_after(3)
    assert [row["round"] for row in run.metrics()] == [1, 2, 3]
    run.append({"round": 4, "env_steps": 41})
    assert run.metrics()[3:] == [{"round": 4, "env_steps": 41}]
    run.forget_rounds_after(0)
    assert run.metrics() == []


def test_snapshots_are_found_by_their_steps_in_order(run: RunFolder) -> None:
    for steps in (100_000, 0, 9_000):
        with run.snapshot(steps) as folder:
            (folder / "policy").write_text(str(steps))
    assert list(run.snapshots()) == [0, 9_000, 100_000]
    assert names(run.path / "snapshots") == ["000000000", "000009000", "000100000"]
    assert (run.snapshots()[9_000] / "policy").read_text() == "9000"


def test_a_snapshot_that_fails_leaves_nothing(run: RunFolder) -> None:
    def fail() -> None:
        with run.snapshot(5) as folder:
            (folder / "policy").write_text("half")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        fail()
    assert run.snapshots() == {}
    assert not (run.path / "snapshots").exists()


def test_what_a_killed_process_left_aside_is_no_snapshot(run: RunFolder) -> None:
    with run.snapshot(5):
        pass
    (run.path / "snapshots" / ".000000007.x1").mkdir()
    assert list(run.snapshots()) == [5]


def test_the_newest_checkpoints_are_kept_and_the_last_one_is_loaded(run: RunFolder) -> None:
    for steps in (900, 1_000, 20_000):
        run.save_checkpoint(steps, {"steps": steps, "weights": torch.full((2,), float(steps))})
        loaded, damaged = run.load_checkpoint()
        assert loaded is not None
        assert damaged == []
        assert loaded["steps"] == steps
        assert loaded["weights"].tolist() == [steps, steps]
    assert KEPT_CHECKPOINTS == 2
    assert names(run.path / "checkpoint") == ["000001000", "000020000"]


def test_a_checkpoint_that_fails_leaves_the_older_one(run: RunFolder) -> None:
    run.save_checkpoint(1, {"steps": 1})
    with pytest.raises(TypeError):
        run.save_checkpoint(2, {"steps": object()})
    assert run.load_checkpoint() == ({"steps": 1}, [])
    assert names(run.path / "checkpoint") == ["000000001"]


@pytest.mark.parametrize("name", ["state.json", "state.safetensors"])
def test_a_torn_last_checkpoint_falls_back_to_the_one_before(run: RunFolder, name: str) -> None:
    for steps in (1, 2):
        run.save_checkpoint(steps, {"steps": torch.full((100,), steps)})
    torn = run.path / "checkpoint" / "000000002" / name
    torn.write_bytes(torn.read_bytes()[:40])
    loaded, damaged = run.load_checkpoint()
    assert loaded is not None
    assert loaded["steps"][0] == 1
    assert len(damaged) == 1
    assert "000000002" in damaged[0]


def test_a_damaged_checkpoint_is_the_users_to_mend(run: RunFolder) -> None:
    run.save_checkpoint(1, {"steps": torch.zeros(1)})
    for file in (run.path / "checkpoint" / "000000001").iterdir():
        file.write_bytes(b"")
    with pytest.raises(UserError, match="000000001"):
        run.load_checkpoint()


@given(st.integers(1, 10_000_000), st.integers(0, 10))
def test_snapshots_are_due_at_the_ends_the_quarters_and_the_halvings(total: int, halvings: int) -> None:
    steps = snapshot_steps(total, halvings)
    assert steps == sorted(set(steps))
    assert (steps[0], steps[-1]) == (0, total)
    wanted = {total * k // 4 for k in range(5)} | {int(total * 0.5**k) for k in range(halvings + 1)}
    assert set(steps) == wanted


def test_snapshot_steps_of_the_quickstart() -> None:
    expected = [0, 3_840, 7_680, 15_360, 30_720, 61_440, 122_880, 184_320, 245_760]
    assert snapshot_steps(245_760) == expected


@pytest.mark.parametrize("name", ["checkpoint", "snapshots", "metrics.jsonl", "checkpoint/logs"])
def test_a_run_that_leads_elsewhere_is_not_opened(run: RunFolder, tmp_path: Path, name: str) -> None:
    (tmp_path / "elsewhere").mkdir()
    (run.path / name).parent.mkdir(exist_ok=True)
    (run.path / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UserError, match=rf"{name} is a link to .*elsewhere"):
        open_run(run.path)
