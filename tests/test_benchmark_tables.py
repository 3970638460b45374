"""Tables that scripts/benchmarks makes stand in its documents as its committed JSON says."""

import json
from importlib import import_module
from pathlib import Path
from typing import Any

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


def a_reward(
    seed: int = 1, probe: str = "aa", steps: int = 20_000, **weights: dict[str, Any]
) -> dict[str, Any]:
    """The JSON of a judged reward, as far as the tables read it."""
    between = {name: {"value": 0.9} for name in ("spearman", "kendall", "regret")}
    return {
        "method": "airl",
        "reward": "airl",
        "task": "Hopper-v5",
        "seed": seed,
        "env_steps": 9,
        "score": 0.99,
        "distances": {"headline": {"value": 0.36}, "probe_sha256": probe, "gamma": 0.99, "steps": steps},
        "terms": {"weights": weights, "survival_bonus": 1.0, "explained": 0.62},
        "cross_play": between,
        "kendall": [0.5, 0.9],
        "drift": {"snapshots": [0, 9], "to_truth": [0.5, 0.36]},
        "verdicts": {"stable": True},
    }


def weight(value: float, low: float, high: float, why_not: str | None = None) -> dict[str, Any]:
    return {"weight": value, "low": low, "high": high, "share": 0.3, "why_not": why_not}


def cells(line: str) -> list[str]:
    return line.strip("| ").split(" | ")


@pytest.mark.parametrize(
    ("forward", "ctrl", "shown"),
    [
        (weight(0.5, 0.4, 0.6), weight(2.0, 1.0, 3.0), ["0.30, 0.30", "4.00", "2.00"]),
        (weight(0.5, -0.1, 1.1), weight(2.0, 1.0, 3.0), ["0.30 (?), 0.30", "–", "–"]),
        (weight(0.5, 0.4, 0.6), weight(-2.0, -3.0, -1.0, "small"), ["0.30, 0.30 (-)", "–", "2.00"]),
        (weight(-0.5, -0.6, -0.4), weight(2.0, 1.0, 3.0), ["0.30 (-), 0.30", "4.00", "2.00"]),
        (weight(0.5, 0.4, 0.6, "small"), weight(2.0, 1.0, 3.0), ["0.30, 0.30", "–", "–"]),
    ],
)
def test_control_and_the_bonus_are_to_a_forward_that_weighs_something(
    forward: dict[str, Any], ctrl: dict[str, Any], shown: list[str]
) -> None:
    truth = import_module("truth")

    line = dict(zip(truth.HEAD, cells(truth.line(a_reward(forward=forward, ctrl=ctrl), [], {})), strict=True))
    columns = ("shares of forward, ctrl", "ctrl to forward", "bonus to forward")
    assert [line[name] for name in columns] == shown


def test_a_reward_judged_on_another_probe_has_no_numbers_beside_the_others(tmp_path: Path) -> None:
    truth, judged = import_module("truth"), import_module("judged")

    (tmp_path / "rewards").mkdir()
    forward, ctrl = weight(0.5, 0.4, 0.6), weight(2.0, 1.0, 3.0)
    for seed, probe, steps in ((1, "bb" * 32, 3080), (2, "aa", 20_000), (3, "aa", 20_000)):
        found = a_reward(seed, probe, steps, forward=forward, ctrl=ctrl)
        (tmp_path / "rewards" / f"{seed}.json").write_text(json.dumps(found))
    reason = "on another probe: bbbbbbbb, 3,080 steps, gamma 0.99"
    other, first, second = map(cells, truth.table(truth.Settings(results=tmp_path)).splitlines()[2:])
    assert other == ["airl", "Hopper", "1", "0.990", *"–––––––––", reason]
    assert first[4:] == second[4:] == ["0.36", "0.30, 0.30", "4.00", "2.00", "0.62", "0.90", *"–––", "stable"]
    made = judged.tables(tmp_path / "rewards")
    other, first, second = map(cells, made.splitlines()[2:5])
    assert other == ["airl", "Hopper", "1", "0.990", *"–––––––", reason]
    assert first[4:] == second[4:]
    assert "| airl | Hopper | 1 | VAL |" not in made
    assert "| airl | Hopper | 2 | VAL | 0.36 |" in made


def test_the_usual_probe_is_that_of_most_and_of_two_as_frequent_the_larger() -> None:
    judged = import_module("judged")

    small, large = a_reward(probe="bb", steps=3080), a_reward(probe="aa")
    assert judged.usual([small, large]) == judged.usual([large, small]) == {("Hopper-v5", "aa", 0.99)}
    assert judged.usual([small, small, large]) == {("Hopper-v5", "bb", 0.99)}
    other = large | {"distances": large["distances"] | {"gamma": 0.98}}
    assert judged.alone(other, judged.usual([large, large, other])) is not None
    assert judged.alone(large, judged.usual([large, large, other])) is None


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
