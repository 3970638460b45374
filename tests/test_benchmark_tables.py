"""Tables that scripts/benchmarks makes stand in its documents as its committed JSON says."""

import json
from importlib import import_module
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[1] / "scripts" / "benchmarks"


@pytest.fixture(autouse=True)
def beside(monkeypatch: pytest.MonkeyPatch) -> None:
    """The scripts import each other by name."""
    monkeypatch.syspath_prepend(BENCHMARKS)


def lines(document: str) -> list[str]:
    return (BENCHMARKS / document).read_text(encoding="utf-8").splitlines()


def test_findings_have_every_judged_reward() -> None:
    truth = import_module("truth")

    made = truth.table(truth.Settings()).splitlines()
    assert len(made) > 15
    assert [line for line in made if line not in lines("FINDINGS.md")] == []


def test_switches_have_every_score() -> None:
    switches = import_module("switches")

    made = switches.table(switches.Settings()).splitlines()
    assert len(made) > 20
    assert [line for line in made if line not in lines("SWITCHES.md")] == []


def test_a_control_is_by_the_same_learner_there() -> None:
    truth = import_module("truth")

    extra = f"--average --part f {truth.BONUS}"
    row = {"run": "airl-hopper-s1", "env_steps": 9, "seeds": [1], "dynamics": "mass=1.5", "extra": extra}
    control = row | {"run": "gail-hopper-s1", "extra": f"--hand-written {truth.BONUS}"}
    assert truth.circumstances(row) == truth.circumstances(control)
    others = (
        {"run": "airl-ant-s1"},
        {"env_steps": 18},
        {"seeds": [2]},
        {"dynamics": "mass=2"},
        {"extra": "--hand-written"},
    )
    found = {"method": "airl", "task": "Walker2d-v5", "seed": 1, "env_steps": 9, "reward": "airl"}
    walked = {"run": "airl-walker2d-s1", "reward": "airl", "snapshot": 9, "extra": truth.BONUS}
    assert truth.same(walked, found)
    assert not truth.same(walked | {"extra": truth.SHORT}, found)
    for other in others:
        assert truth.circumstances(row) != truth.circumstances(control | other)


def test_what_gails_reward_pays_is_what_the_json_has() -> None:
    def paid(folder: str, policy: str) -> list[int]:
        files = [BENCHMARKS / "results" / folder / f"gail-halfcheetah-s{seed}.json" for seed in (1, 2, 3)]
        return [round(json.loads(file.read_text())["paid"][policy]) for file in files]

    def each(values: list[int]) -> str:
        return " ".join(map(str, values))

    still, expert = ([paid(of, who) for of in ("rewards", "memory")] for who in ("holding still", "expert"))
    last = f"{each(still[0])}, {min(expert[0])} to {max(expert[0])}"
    name = "paid for standing still, and for the expert's episode"
    row = f"| {name} | {last} | {each(still[1])}, {each(expert[1])} |"
    assert row in lines("FINDINGS.md")
