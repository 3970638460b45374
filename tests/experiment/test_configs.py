"""Which runs would end before their policy learns: told without a run, refused before one."""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from irl.algorithms.forward import Forward
from irl.core.config import from_json, to_json
from irl.core.errors import UserError
from irl.experiment.configs import DACRun, Imitation, check_learns, untaught
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.learners.td3 import TD3Config
from irl.rewards.mujoco import HandWritten
from tests.experiment.conftest import DATASET, TASK

SAC = SACConfig(steps_per_round=8, batch_size=4, hidden=(4,))
TD3 = TD3Config(steps_per_round=8, batch_size=4, hidden=(4,))
PPO = PPOConfig(n_envs=2, steps_per_round=8, batch_size=4, n_epochs=1, hidden=(4,))
LINEAR: tuple[Literal["constant", "linear"], ...] = ("constant", "linear")


def learned(learner: Any, steps: int) -> bool:
    """Whether a run of so many steps moves a weight of the policy."""
    before = learner.policy().weights
    for _ in Forward(learner, HandWritten()).rounds(steps):
        pass
    learner.close()
    # a normaliser of PPO's own follows what is seen, whatever the rate
    now = {name: value for name, value in learner.policy().weights.items() if not name.startswith("obs_")}
    return any(not np.array_equal(before[name], value) for name, value in now.items())


@pytest.mark.parametrize("n_envs", [1, 4])
@pytest.mark.parametrize("schedule", LINEAR)
def test_off_policy_it_says_just_what_the_weights_do(n_envs: int, schedule: Any) -> None:
    seeds, found = list(range(n_envs)), set()
    for starts, steps in product((0, 7, 8, 11), (1, 4, 5, 8, 9, 12, 13)):
        config = replace(SAC, n_envs=n_envs, learning_starts=starts, lr_schedule=schedule)
        learner = SACLearner(TASK, seeds, config, seed=0, total_steps=steps)
        learns = learned(learner, steps)
        found.add(learns)
        assert (untaught(config, steps) == "") == learns, (starts, steps)
    assert found == {False, True}


@pytest.mark.parametrize("schedule", LINEAR)
@pytest.mark.parametrize("steps", [7, 8, 9, 16])
def test_ppos_only_round_is_at_rate_0_where_the_rate_falls(schedule: Any, steps: int) -> None:
    config = replace(PPO, lr_schedule=schedule)
    learns = learned(PPOLearner(TASK, [0, 1], config, seed=0, total_steps=steps), steps)
    assert (untaught(config, steps) == "") == learns == (schedule == "constant" or steps > 8)
    # said, and not refused
    check_learns(config, steps)


def test_the_steps_that_it_names_are_enough() -> None:
    for learner in (replace(TD3, learning_starts=11), replace(SAC, learning_starts=8, lr_schedule="linear")):
        named = int(untaught(learner, 8).split("choose --steps ")[1].split()[0])
        assert untaught(learner, named) == ""


@pytest.mark.parametrize("method", ["dac", "gail-sac", "gail-td3", "dac-td3", "airl-sac"])
def test_a_run_that_would_not_learn_is_refused_and_leaves_nothing(
    method: str, irl: Callable[..., None], tmp_path: Path, capfd: pytest.CaptureFixture
) -> None:
    for more in ((), ("--seeds=0-1",)):
        with pytest.raises(SystemExit) as stopped:
            irl("train", method, "--env-id", TASK, "--demos", DATASET, "--steps", 1000, "--out", "run", *more)
        said = capfd.readouterr().err
        assert stopped.value.code == 2
        assert said.count("\n") == 1
        assert "--steps 1000 leaves the policy as it began" in said
        assert "is at step 1001, and the run ends at 1000; choose --steps 100" in said
    assert list(tmp_path.iterdir()) == []


def test_the_settings_of_one_that_did_not_learn_are_still_read() -> None:
    short = DACRun(TASK, steps=1000)
    assert from_json(Imitation, to_json(short)) == short
    with pytest.raises(UserError, match="choose --steps 1002 or more"):
        short.resolved()
