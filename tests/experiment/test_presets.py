"""Every preset is what it says, comes back through JSON, and makes a run of the real task."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from irl.core import files
from irl.core.config import from_json, to_json
from irl.core.errors import UserError
from irl.demos.load import load_demos
from irl.experiment import build
from irl.experiment.cli import COMMANDS
from irl.experiment.configs import Imitation
from irl.experiment.preset import with_preset
from irl.experiment.presets import PRESETS
from tests.experiment.conftest import DATASET, QUICK, TASK


def run(name: str, env_id: str = "Hopper-v5") -> Any:
    cls, _ = COMMANDS["train", PRESETS[name].method]
    return with_preset(cls(env_id=env_id), name)


@pytest.mark.parametrize("name", PRESETS)
def test_it_comes_back_through_json_with_every_setting_and_names_its_source(name: str) -> None:
    config = run(name)
    assert from_json(Imitation, to_json(config)) == config
    for setting, value in PRESETS[name].settings.items():
        found = config
        for part in setting.split("."):
            found = getattr(found, part)
        assert found == value
    assert config.preset == name
    assert PRESETS[name].source
    assert PRESETS[name].differs


@pytest.mark.parametrize("name", PRESETS)
def test_it_makes_what_is_trained(name: str, home: Path) -> None:
    config = run(name, TASK)
    demos = load_demos(DATASET, episodes=4, root=home / "datasets")
    learner = config.learner
    if learner.KIND in ("sac", "td3"):
        learner = replace(learner, products="float32", buffer_size=100)
    algorithm = build.imitation(replace(config, steps=100, learner=learner), demos.episodes)
    algorithm.learner.close()


def test_typed_settings_go_over_it_and_the_run_says_which_it_was(
    irl: Callable[..., None], capsys: pytest.CaptureFixture
) -> None:
    irl("train", "gail", "--preset", "kostrikov-ppo", "--env-id", TASK, "--out", "run", *QUICK)
    config = files.read_json(Path("run/config.json"))
    assert config["preset"] == "kostrikov-ppo"
    assert config["discriminator"]["gradient_penalty"] == 10.0
    assert (config["steps"], config["discriminator"]["hidden"]) == (768, [16])
    for words in (("--preset=dac-paper",), ("--preset", "nothing")):
        with pytest.raises(SystemExit):
            irl("train", "gail", "--env-id", TASK, *words)
    said = capsys.readouterr().err
    assert "irl train dac-td3 --preset dac-paper" in said
    assert "there are: dac-paper" in said


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(UserError, match="no preset 'x'"):
        with_preset(run("orsini"), "x")
