"""Runs beside each other: what is averaged as seeds of one method, and what is not."""

from dataclasses import replace
from typing import Any

from irl.report.folder import RunFiles
from irl.report.grouping import labels
from irl.report.sections.compare import compare


def a_run(name: str, **config: Any) -> RunFiles:
    evaluation = {"policy": {"normalised_score": 0.5}}
    settings = {"kind": "gail", "env_id": "Hopper-v5", "out": name, **config}
    return RunFiles(name, settings, {}, [], evaluation, {})


def test_runs_of_other_settings_are_not_seeds_of_one_method() -> None:
    few, many = (
        [a_run(f"{n}-{seed}", seed=seed, demo_episodes=n, threads=seed, learner={"lr": 1}) for seed in (1, 2)]
        for n in (1, 25)
    )
    assert set(labels(few).values()) == {"gail, Hopper-v5"}
    table = compare([*few, *many]).tables[1]
    assert [row[:3] for row in table.rows if row[1] == "score"] == [
        ("gail, Hopper-v5, demo_episodes 1", "score", 2.0),
        ("gail, Hopper-v5, demo_episodes 25", "score", 2.0),
    ]


def test_a_retraining_is_not_averaged_with_its_control_nor_with_another_methods() -> None:
    of = {"kind": "retrain", "snapshot": 9}
    old, new = (
        a_run("a", run="runs/gail-hopper-s1", **of),
        a_run("b", run="runs/gail-hopper-s2", hand_written=False, **of),
    )
    control = a_run("c", run="runs/gail-hopper-s1", hand_written=True, **of)
    other = a_run("d", run="runs/airl-hopper-s1", **of)
    assert len(set(labels([old, new]).values())) == 1
    said = [*labels([old, new, control, other]).values()]
    assert said[0] == said[1] == "retrain, Hopper-v5, reward of gail-hopper, hand_written not set"
    assert len(set(said)) == 3


def test_policies_on_g_and_on_f_are_two_things() -> None:
    of = {"kind": "retrain", "snapshot": 9, "run": "runs/airl-hopper-s1"}
    g, again, f = (
        replace(a_run(n, **of), paid={"reward_map": m}) for n, m in (("a", "g"), ("b", "g"), ("c", "f"))
    )
    assert [*labels([g, again, f]).values()] == [
        "retrain, Hopper-v5, reward paid g",
        "retrain, Hopper-v5, reward paid g",
        "retrain, Hopper-v5, reward paid f",
    ]


def test_a_label_says_a_few_settings_and_stays_one_of_its_own() -> None:
    runs = [a_run(str(i), **dict.fromkeys("abcde", 1), f=i) for i in (1, 2)]
    runs += [a_run("3", **dict.fromkeys("abcde", 2), f=i) for i in (1, 2)]
    said = [*labels(runs).values()]
    assert said[0] == "gail, Hopper-v5, a 1, b 1, c 1, d 1, and 2 more"
    assert len(set(said)) == 4
