"""What a worker goes on with, and what it refuses as another cell's or as taught by another reward."""

import json
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from irl.bench.cells import LATER, Cell
from irl.bench.leash import PROGRAM
from irl.bench.processes import Processes
from irl.bench.worker import Outcome, Places, carry_out
from irl.core import files
from irl.core.config import to_json

RUN = Cell("g", "gail-hopper-d5-s1", "train", "gail", "gail", "Hopper-v5", 1, 1000, 5, 1, ())
FRESH = replace(
    RUN,
    name=f"{RUN.name}-ppo-on-100",
    kind="retrain",
    steps=500,
    source=RUN.name,
    share=1.0,
    algo="ppo",
    source_steps=RUN.steps,
    source_words=("gail", *RUN.words),
)


class Failing(Processes):
    """Notes the commands of irl, and none of them does anything."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[tuple[str, ...]] = []

    def run(self, words: Sequence[str], log: Path, env: object = None) -> int:
        self.said.append(tuple(words[len(PROGRAM) :]))
        log.write_text("irl: no memory left\n")
        return 1


@pytest.fixture
def processes() -> Failing:
    return Failing()


@pytest.fixture
def places(tmp_path: Path) -> Places:
    """A folder of runs, and one with the expert's episodes."""
    (tmp_path / "datasets" / "irl" / "hopper" / "expert-v0" / "data").mkdir(parents=True)
    (tmp_path / "runs").mkdir()
    return Places(tmp_path / "runs", tmp_path / "datasets")


def reward(places: Places, steps: int, weights: bytes) -> dict[str, Any]:
    """A snapshot of the source with this reward; what is written down of it."""
    folder = places.runs / RUN.name / "snapshots" / f"{steps:09d}" / "reward"
    folder.mkdir(parents=True, exist_ok=True)
    (path := folder / "weights.safetensors").write_bytes(weights)
    (places.runs / RUN.name / "config.json").write_text("{}")
    judged = {"env_steps": steps, "policy": {"normalised_score": 0.5}}
    (places.runs / RUN.name / "evaluation.json").write_text(json.dumps(judged))
    return {"env_steps": steps, "weights_sha256": files.sha256(path)}


def retrained(places: Places, of: dict[str, Any]) -> Path:
    """A finished run of `irl retrain`."""
    (run := places.runs / FRESH.name).mkdir()
    ends = {"random_return_mean": 0.0, "expert_return_mean": 1.0}
    true = {"normalised_score": 0.5, "return_mean": 1.0, "return_std": 0.0, "return_min": 1.0, **ends}
    found = {"env_steps": 512, "true": true, "learned": {"return_mean": 2.0}, "reward": of}
    where = ("packages", "machine", "device", "threads", "git_commit", "git_dirty")
    documents = {"config": {}, "environment": dict.fromkeys(where), "reward": of, "retrain": found}
    for name, content in documents.items():
        (run / f"{name}.json").write_text(json.dumps(content))
    (run / "metrics.jsonl").write_text(json.dumps({"round": 1, "wall_s": 2.0}) + "\n")
    return run


def published(outcome: Outcome) -> Any:
    assert outcome.result is not None, outcome.why
    return outcome.result["snapshot"]


def test_a_retraining_counts_for_the_reward_that_taught_it(places: Places, processes: Failing) -> None:
    run = retrained(places, reward(places, 512, b"first"))
    assert published(carry_out(FRESH, places, processes)) == 512
    reward(places, 512, b"other")
    why = carry_out(FRESH, places, processes).why
    assert f"{run} is a retraining on another reward than {places.runs / RUN.name}" in why
    assert "weights_sha256 was " in why
    assert why.endswith("take it away, and it is made again")
    reward(places, 512, b"first")
    reward(places, 2000, b"first")
    assert "env_steps was 512 and is 2000" in carry_out(FRESH, places, processes).why
    # one that is half done is not gone on with either
    (run / "retrain.json").unlink()
    assert "env_steps was 512 and is 2000" in carry_out(FRESH, places, processes).why
    assert processes.said == []
    shutil.rmtree(places.runs / RUN.name / "snapshots" / "000002000")
    reward(places, 512, b"first")
    assert carry_out(FRESH, places, processes).why == "no memory left"
    assert processes.said == [("retrain", "--resume", str(run))]


def test_a_retraining_on_a_mean_counts_for_every_reward_in_it(places: Places, processes: Failing) -> None:
    every = {at: reward(places, at, b"%d" % at) for at in (0, 256, 512)}
    over = {str(at): every[at]["weights_sha256"] for at in (256, 512)}
    retrained(places, every[512] | {"average_over": over})
    assert published(carry_out(FRESH, places, processes)) == 512
    reward(places, 256, b"other")
    reward(places, 512, b"512")
    assert "average_over.256 was " in carry_out(FRESH, places, processes).why


def test_a_retraining_of_a_source_by_other_settings_is_another_cell(
    places: Places, processes: Failing
) -> None:
    retrained(places, reward(places, 512, b"first"))
    path = places.runs / f"{FRESH.name}.cell.json"
    # written before cells said this of their sources
    path.write_text(json.dumps({k: v for k, v in to_json(FRESH).items() if k not in LATER}))
    assert published(carry_out(FRESH, places, processes)) == 512
    assert json.loads(path.read_text()) == to_json(FRESH)
    why = carry_out(replace(FRESH, source_steps=2000), places, processes).why
    assert why.startswith(
        f"the run {FRESH.name} was begun as another cell: source_steps was 1000 and is 2000"
    )


def test_what_never_began_or_was_taken_away_is_no_other_cell(places: Places, processes: Failing) -> None:
    longer, run = replace(RUN, steps=2000), places.runs / RUN.name
    # it fails before there is a run
    assert carry_out(RUN, places, processes).why == "no memory left"
    assert carry_out(longer, places, processes).why == "no memory left"
    assert [words[words.index("--steps") + 1] for words in processes.said] == ["1000", "2000"]
    run.mkdir()
    (run / "config.json").write_text("{}")
    why = carry_out(RUN, places, processes).why
    assert "was begun as another cell: steps was 2000 and is 1000; take it out of" in why
    assert len(processes.said) == 2
    # as the message says
    shutil.rmtree(run)
    assert carry_out(RUN, places, processes).why == "no memory left"
    assert processes.said[2] == processes.said[0]
