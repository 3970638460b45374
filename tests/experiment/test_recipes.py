from pathlib import Path

import pytest

from irl.core.config import to_json
from irl.experiment.recipes import MEDIUM, RECIPES, recipe
from irl.policies import shelf

SHIPPED = shelf.cards(Path("expert_data/policies"))


@pytest.mark.parametrize("card", SHIPPED, ids=lambda card: f"{card.env_id} {card.level}")
def test_a_shipped_policy_was_made_by_the_row_that_its_task_and_level_name(card: shelf.Card) -> None:
    algo, row = recipe(card.env_id, None, card.level)
    now = to_json(row.learner)
    assert algo == card.algorithm
    # whole rounds; and settings that came later are at what was fixed before
    assert row.steps <= card.steps < row.steps + 20_000
    # the number format is the machine's, of those that make the same expert
    its = {name: value for name, value in card.settings.items() if name != "products"}
    assert {name: now[name] for name in its} == its


def test_a_task_without_a_row_gets_the_defaults() -> None:
    assert recipe("Nothing-v0", None)[0] == "ppo"
    assert recipe("Nothing-v0", "sac") == recipe("Other-v0", "sac")
    task, algo = next(iter(RECIPES))
    assert recipe(task, None) == (algo, RECIPES[task, algo])


def test_a_medium_policy_has_its_own_row_and_any_other_level_the_experts() -> None:
    assert recipe("Hopper-v5", None, "medium") == ("ppo", MEDIUM["Hopper-v5", "ppo"])
    assert recipe("Hopper-v5", None, "mine") == recipe("Hopper-v5", None)
    # HalfCheetah's expert is SAC's, and its medium policy PPO's
    assert recipe("HalfCheetah-v5", None, "medium")[0] == "ppo"
    assert recipe("HalfCheetah-v5", "sac", "medium") == recipe("HalfCheetah-v5", None)
    assert recipe("Nothing-v0", None, "medium") == recipe("Nothing-v0", None)
