"""What README tells a reader to type works, on the real task."""

import re
from pathlib import Path

import pytest
from stable_baselines3 import PPO

from irl.core.records import open_run
from irl.experiment.cli import COMMANDS, main

README = Path(__file__).parents[1] / "README.md"


def test_the_library_lines_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    main(["demos", "generate", "--env-id", "Hopper-v5", "--episodes", "5", "--seed", "0"])
    words = "--demos irl/hopper/expert-v0 --demo-episodes 4 --steps 2048 --watch.eval-episodes 0"
    main(f"train gail --env-id Hopper-v5 --out runs/hopper {words} --schedule.epochs 1".split())
    block, ready_made, judged = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)
    last = list(open_run(Path("runs/hopper")).snapshots().values())[-1].name
    capsys.readouterr()
    names: dict[str, object] = {"PPO": PPO}
    exec(block.replace("000245760", last), names)
    printed = re.findall(r"-?\d+\.\d+", capsys.readouterr().out)
    assert len(printed) == 3
    exec(ready_made.replace("200_000", "2048"), names)
    assert names["reward"].spec.env_steps == 2048  # pyright: ignore[reportAttributeAccessIssue]
    main(["probe", "--env-id", "Hopper-v5", "--steps", "500", "--out", "hopper.npz"])
    capsys.readouterr()
    exec(judged, {})
    assert "VAL, n = 50" in capsys.readouterr().out


def test_every_command_it_names_exists() -> None:
    named = {tuple(words.split()) for words in re.findall(r"`irl ([a-z]+(?: [a-z]+)?)", README.read_text())}
    known = set(COMMANDS) | {name[:1] for name in COMMANDS}
    assert {name for name in named if name not in known and name[:1] not in COMMANDS} == set()
    assert named


def test_its_table_of_experts_is_that_of_the_shelf(capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("IRL_POLICIES_PATH", raising=False)
    main(["experts", "list", "--markdown"])
    printed = [line.strip() for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert [line for line in printed if line not in README.read_text()] == []
