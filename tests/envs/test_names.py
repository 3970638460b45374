"""A task's full name, and what it becomes in folders."""

import pytest

from irl.core.errors import UserError
from irl.envs.make import make
from irl.envs.names import full_name, split_name
from irl.envs.tasks import task_name, task_of


def test_arguments_reach_the_environment() -> None:
    name = full_name("Hopper-v5", ("ctrl_cost_weight=0.5", '{"terminate_when_unhealthy": false}'))
    env = make(name)
    assert env.unwrapped._ctrl_cost_weight == 0.5  # pyright: ignore[reportAttributeAccessIssue]
    assert env.unwrapped._terminate_when_unhealthy is False  # pyright: ignore[reportAttributeAccessIssue]
    assert env.spec is not None
    assert (env.spec.id, env.spec.kwargs["ctrl_cost_weight"]) == ("Hopper-v5", 0.5)
    env.close()


def test_a_name_is_the_same_however_it_is_written() -> None:
    words = ("b=text", "a=1")
    name = full_name("X-v0", words)
    assert name == full_name("X-v0", words[::-1]) == full_name(full_name("X-v0", words[:1]), words[1:])
    assert split_name(name) == ("X-v0", {"a": 1, "b": "text"})
    assert full_name("X-v0", ()) == "X-v0"


def test_pythons_own_words_are_no_text() -> None:
    name = full_name("X-v0", ("no=False", "yes=True", "none=None", "text=Falsehood", 'quoted="False"'))
    given = {"no": False, "yes": True, "none": None, "text": "Falsehood", "quoted": "False"}
    assert split_name(name) == ("X-v0", given)
    assert name == full_name(
        "X-v0", ("no=false", "yes=true", "none=null", "text=Falsehood", 'quoted="False"')
    )


def test_a_variant_is_a_task_of_its_own() -> None:
    variant = full_name("Hopper-v5", ("ctrl_cost_weight=0.5",))
    assert task_of(variant) is task_of("Hopper-v5")
    assert task_name("Hopper-v5") == "hopper"
    assert task_name(variant).startswith("hopper-")
    assert task_name(variant) != task_name(full_name("Hopper-v5", ("ctrl_cost_weight=0.6",)))


@pytest.mark.parametrize("words", [("x",), ("=1",), ("{",), ("[1]",), ("a=1", "a=2"), ('{"a": 1}', "a=1")])
def test_what_is_no_argument(words) -> None:
    with pytest.raises(UserError, match=r"--env-kwargs|JSON"):
        full_name("X-v0", words)


def test_a_name_that_ends_in_no_json() -> None:
    for name in ("Hopper-v5?{", "Hopper-v5?1"):
        with pytest.raises(UserError, match=r"what follows the \?"):
            make(name)
