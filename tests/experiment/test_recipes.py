from pathlib import Path

import pytest

from irl.core.config import to_json
from irl.experiment.recipes import RECIPES, recipe
from irl.policies import shelf

SHIPPED = [card for card in shelf.cards(Path("expert_data/policies")) if card.level == "expert"]


@pytest.mark.parametrize("card", SHIPPED, ids=lambda card: card.env_id)
def test_a_shipped_expert_was_made_by_the_row_that_its_task_alone_names(card: shelf.Card) -> None:
    algo, row = recipe(card.env_id, None)
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
