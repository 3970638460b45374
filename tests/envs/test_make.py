"""What cannot be made is refused in one line, and nothing is printed."""

import gymnasium as gym
import pytest
from gymnasium.spaces import Box

from irl.core.errors import UserError
from irl.envs.make import make, near_ids


def test_makes_the_environment_of_the_id():
    env = make("Hopper-v5", terminate_when_unhealthy=False)
    assert env.spec is not None
    assert env.spec.id == "Hopper-v5"
    assert env.unwrapped._terminate_when_unhealthy is False  # pyright: ignore[reportAttributeAccessIssue]
    env.close()


@pytest.mark.parametrize("env_id", ["Hoper-v5", "Hopper-v9", "Hopper", "hopper-v5", "Hopper-v2", "Hopper v5"])
def test_a_near_miss_names_the_newest_version(env_id: str, capfd: pytest.CaptureFixture[str]):
    with pytest.raises(UserError, match="near it: Hopper-v5") as caught:
        make(env_id)
    assert repr(env_id) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("env_id", ["", "zzzzz", "ALE/Pong-v5", "no_such_module:Bar-v0"])
def test_nothing_near(env_id: str):
    with pytest.raises(UserError) as caught:
        make(env_id)
    assert "near it" not in str(caught.value)


def test_an_old_version_and_the_compiler_are_quiet(capfd: pytest.CaptureFixture[str]):
    make("HalfCheetah-v4").close()
    assert capfd.readouterr() == ("", "")


def test_a_keyword_the_environment_does_not_know():
    with pytest.raises(UserError, match="unexpected keyword argument 'nonsense'"):
        make("Hopper-v5", nonsense=1)


def test_spaces_that_are_not_flat_boxes():
    with pytest.raises(UserError, match=r"Blackjack-v1 has the observations Tuple"):
        make("Blackjack-v1")
    with pytest.raises(UserError, match=r"FrozenLake-v1 has the observations Discrete\(16\)"):
        make("FrozenLake-v1")


class _Unbounded(gym.Env):
    observation_space = Box(-1, 1, (2,))
    action_space = Box(-float("inf"), float("inf"), (1,))


def test_actions_without_bounds():
    gym.register("IrlUnbounded-v0", lambda **_: _Unbounded())
    try:
        with pytest.raises(UserError, match="finite bounds"):
            make("IrlUnbounded-v0", disable_env_checker=True)
    finally:
        del gym.registry["IrlUnbounded-v0"]


def test_near_ids_are_of_the_newest_version():
    assert near_ids("Walker-v1") == ["Walker2d-v5"]
    assert near_ids("half_cheetah") == ["HalfCheetah-v5"]
