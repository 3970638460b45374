import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import pytest

from irl.core.errors import UserError
from irl.report.folder import read_run
from irl.report.html import write_report
from irl.report.readings import headline, key_numbers
from irl.report.sections.agreement import agreement
from irl.report.sections.fan import fan
from irl.report.sections.moved import moved
from irl.report.sections.policy import policy
from tests.report import whole


def _change(run: Path, evaluation: dict[str, Any]) -> str:
    (run / "evaluation.json").write_text(json.dumps(evaluation))
    return write_report(run).read_text()


def test_the_page_stands_alone(run: Path) -> None:
    target = write_report(run)
    page = target.read_text()
    assert target == run / "report.html"
    assert target.stat().st_size < 8_000_000
    assert page.count("plotly.js v") == 1
    assert "<script src" not in page
    assert "<link" not in page
    assert "default-src 'none'" in page
    assert page.count('<figure class="plot"') == 5
    assert [path.name for path in run.iterdir() if path.name.startswith(".")] == []


def test_the_page_holds_what_a_person_looks_for(run: Path) -> None:
    page = write_report(run).read_text()
    for text in (
        "quickstart",
        "GAIL on Hopper-v5, 122,880 environment steps, learned from 4 demonstrations of irl/hopper/expert-v0",
        "irl train gail",
        "torch 2.13.0",
        "commit dd1a33c0ff",
        "0.951",
    ):
        assert text in page
    for anchor in ("verdicts", "policy", "moved", "fan", "map", "terms", "against", "trust", "notes"):
        assert f'id="{anchor}"' in page


def test_the_command_is_one_to_type(run: Path) -> None:
    environment = json.loads((run / "environment.json").read_text())
    environment["command"] = "-c train gail --seed 1"
    (run / "environment.json").write_text(json.dumps(environment))
    assert "<dd>irl train gail --seed 1</dd>" in write_report(run).read_text()


def test_a_run_that_went_on_by_other_code_says_so(run: Path) -> None:
    environment = json.loads((run / "environment.json").read_text())
    environment["resumed"] = [{"env_steps": 5, "machine": "m"}, {"env_steps": 9, "git_commit": "beef"}]
    (run / "environment.json").write_text(json.dumps(environment))
    assert "commit dd1a33c0ff, then beef" in write_report(run).read_text()
    (run / "environment.json").write_text(json.dumps(environment | {"resumed": 3}))
    assert "commit dd1a33c0ff" in write_report(run).read_text()


def test_a_fit_that_explains_nothing_is_not_shown(run: Path, evaluation: dict[str, Any]) -> None:
    whole.write(run, whole.grow(evaluation, 3))
    assert "a nonlinear fit explains 80 % of it" in write_report(run).read_text()
    page = _change(run, whole.grow(evaluation, 3) | {"residual": {"r2": -3.2, "features": [{"name": "x"}]}})
    assert "320 %" not in page
    assert "a nonlinear fit explains none of it" in page


@pytest.mark.parametrize("r2", [0.8, -3.2])
def test_no_tree_is_spoken_of(run: Path, evaluation: dict[str, Any], r2: float) -> None:
    """What explains the rest is random waves and a ridge (irl.diagnostics.residual)."""
    features = [{"name": "x", "importance": 1.0}]
    whole.write(run, whole.grow(evaluation, 3) | {"residual": {"r2": r2, "features": features}})
    # plotly's own text knows of trees
    said = re.sub(r"<script.*?</script>", "", write_report(run).read_text(), flags=re.DOTALL)
    assert "What the unexplained part depends on" in said
    assert not re.search(r"\btree|\bforest", said, re.IGNORECASE)


def test_a_verdict_says_on_which_side_its_threshold_is(run: Path, evaluation: dict[str, Any]) -> None:
    page = _change(run, whole.grow(evaluation, 3))
    for words in ("good below 0.2", "warns above 0.2", "Only close says"):
        assert words in page
    evaluation["verdicts"] = [{"name": "hacked", "fired": False, "value": 0.0, "threshold": 0.2}]
    assert "None of them says" in _change(run, evaluation)


def test_writing_twice_gives_the_same_page(run: Path) -> None:
    assert write_report(run).read_bytes() == write_report(run).read_bytes()


def test_strings_of_files_are_escaped(run: Path, evaluation: dict[str, Any]) -> None:
    attack = "</script><img src=x onerror=alert(1)>&\"'"
    hostile = _replace_strings(evaluation, attack)
    for name in ("config", "environment"):
        document = json.loads((run / f"{name}.json").read_text())
        (run / f"{name}.json").write_text(json.dumps({**_replace_strings(document, attack), attack: attack}))
    page = _change(run, hostile)
    assert "<img" not in page
    assert "&lt;img src=x onerror=alert(1)&gt;&amp;&quot;" in page
    assert page.count("</script>") == page.count("<script")


def _replace_strings(value: Any, by: str) -> Any:
    if isinstance(value, dict):
        return {key: _replace_strings(item, by) for key, item in value.items()}
    if isinstance(value, list):
        return [_replace_strings(item, by) for item in value]
    return by if isinstance(value, str) else value


def test_an_empty_folder_gives_a_page_of_reasons(tmp_path: Path) -> None:
    page = write_report(tmp_path).read_text()
    assert "evaluation.json is not in the run folder" in page
    assert "metrics.jsonl is not in the run folder" in page
    assert '<figure class="plot"' not in page


def test_a_task_without_a_hand_written_reward_says_so(run: Path, evaluation: dict[str, Any]) -> None:
    reward = evaluation["reward"]
    nothing = dict.fromkeys(("pearson", "spearman", "episode_pearson", "episode_spearman"))
    reward.update(nothing, pearson_reason="this task has no hand-written reward")
    reward["scatter"]["hand_written"] = None
    for stratum in reward["strata"].values():
        stratum["hand_written_mean"] = None
    page = _change(run, evaluation)
    assert "Not shown: this task has no hand-written reward." in page
    assert page.count('<figure class="plot"') == 4


def test_a_run_without_snapshots_says_so(run: Path, evaluation: dict[str, Any]) -> None:
    page = _change(
        run, {**evaluation, "drift": None, "drift_reason": "the run kept one snapshot, a change needs two"}
    )
    assert "Not shown: the run kept one snapshot" in page


@pytest.mark.parametrize("name", ["config.json", "environment.json", "metrics.jsonl", "evaluation.json"])
@pytest.mark.parametrize(
    "content", ["", "{", "[1, 2]", "null", '{"policy": 3, "reward": [1], "drift": "x"}', "\xff"]
)
def test_a_damaged_file_never_stops_the_report(run: Path, name: str, content: str) -> None:
    (run / name).write_bytes(content.encode("latin-1"))
    assert "</html>" in write_report(run).read_text()


def _holes(value: Any, path: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    if not isinstance(value, dict):
        return [path]
    return [path, *(hole for key, item in value.items() for hole in _holes(item, (*path, key)))]


READERS = {
    "references": [policy],
    "reward": [agreement],
    "drift": [fan, moved],
}


@pytest.mark.parametrize("filler", [None, "text", [None], {}, True])
def test_any_part_of_the_evaluation_may_be_missing(
    run: Path, evaluation: dict[str, Any], filler: Any
) -> None:
    files = read_run(run)
    files = dataclasses.replace(files, metrics=files.metrics[:10])
    evaluation["reward"]["scatter"] = {k: v[::100] for k, v in evaluation["reward"]["scatter"].items()}
    for path in _holes(evaluation)[1::3]:
        holed = json.loads(json.dumps(evaluation))
        parent = holed
        for key in path[:-1]:
            parent = parent[key]
        parent[path[-1]] = filler
        for section in READERS.get(path[0], []):
            assert section(dataclasses.replace(files, evaluation=holed)).text
        assert len(key_numbers(holed)) == 11
        assert headline(holed)


def test_a_folder_that_is_not_there_is_the_users_to_mend(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="irl train"):
        write_report(tmp_path / "nothing")
