"""`irl report`: which page is written where, and when again."""

from pathlib import Path

import pytest

from irl.experiment import reports
from irl.experiment.cli import main


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "metrics.jsonl").write_text('{"env_steps": 1, "return_mean": 2.5}\n')
    return tmp_path / "run"


def test_one_run_has_its_page_in_its_folder_and_several_here(
    run: Path, capsys: pytest.CaptureFixture
) -> None:
    main(["report", "run"])
    main(["report", "run", "run", "--out", "both.html"])
    assert (run / "report.html").is_file()
    assert Path("both.html").is_file()
    assert "report: both.html" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["report"], ["report", "nowhere"], ["report", "run", "--every", "0"]])
def test_what_cannot_be_is_one_line(run: Path, words: list[str], capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(words)
    assert stopped.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_watched_run_is_written_again_when_it_goes_on(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[str] = []

    def sleep(seconds: float) -> None:
        looked.append((run / "report.html").read_text())
        if len(looked) == 1:
            (run / "metrics.jsonl").write_text('{"env_steps": 9, "return_mean": 98765.0}\n')
        if len(looked) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(reports.time, "sleep", sleep)
    with pytest.raises(SystemExit) as stopped:
        main(["report", "run", "--watch"])
    assert stopped.value.code == 130
    assert '"y":[98765.0]' not in looked[0]
    assert '"y":[98765.0]' in looked[1]
    assert ['http-equiv="refresh"' in page for page in (*looked, (run / "report.html").read_text())] == [
        True,
        True,
        False,
    ]
