import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from irl.algorithms.adversarial import ScheduleConfig
from irl.algorithms.bc import WarmStartConfig
from irl.core.config import from_json, to_json
from irl.core.errors import UserError
from irl.discriminators.airl import AIRLConfig
from irl.discriminators.dac import DACConfig
from irl.discriminators.gail import GAILConfig
from irl.experiment.configs import (
    AIRLRun,
    BCRun,
    ClonedConfig,
    DACRun,
    DACTD3Run,
    ExpertRun,
    GAILRun,
    GAILSACRun,
    GAILTD3Run,
    Watch,
)
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig


@dataclass(frozen=True)
class Circle:
    KIND: ClassVar[str] = "circle"
    size: float = 1.0


@dataclass(frozen=True)
class Square:
    KIND: ClassVar[str] = "square"
    size: float = 1.0


@dataclass(frozen=True)
class Plain:
    name: str
    n: int = 1

    def __post_init__(self) -> None:
        if self.n < 1:
            raise ValueError(f"n must be at least 1, not {self.n}")


@dataclass(frozen=True)
class Whole:
    shape: Circle | Square
    spare: Circle | Square | None
    plain: Plain
    count: int
    ratio: float
    on: bool
    text: str
    path: Path
    maybe: Path | None
    sizes: tuple[int, ...]
    parts: tuple[Plain, ...]
    mode: Literal["slow", "fast"]
    free: dict[str, Any]


WHOLE = Whole(
    shape=Square(2.0),
    spare=None,
    plain=Plain("p"),
    count=3,
    ratio=0.5,
    on=True,
    text="t",
    path=Path("a/b"),
    maybe=None,
    sizes=(1, 2),
    parts=(Plain("x", 2), Plain("y")),
    mode="fast",
    free={"k": [1]},
)


def through_json(config: Any) -> Any:
    return from_json(type(config), json.loads(json.dumps(to_json(config))))


finite = st.floats(allow_nan=False, allow_infinity=False)
shapes = st.builds(Circle, finite) | st.builds(Square, finite)
plains = st.builds(Plain, st.text(max_size=3), st.integers(1))
paths = st.sampled_from([Path("a"), Path("/x/y.z")])


@given(
    st.builds(
        Whole,
        shape=shapes,
        spare=st.none() | shapes,
        plain=plains,
        count=st.integers(),
        ratio=finite,
        on=st.booleans(),
        text=st.text(max_size=3),
        path=paths,
        maybe=st.none() | paths,
        sizes=st.lists(st.integers(), max_size=3).map(tuple),
        parts=st.lists(plains, max_size=2).map(tuple),
        mode=st.sampled_from(["slow", "fast"]),
        free=st.just({"k": [1]}),
    )
)
def test_a_config_comes_back_through_json(config: Whole) -> None:
    assert through_json(config) == config


def test_the_chosen_kind_is_written_and_decides() -> None:
    content = to_json(WHOLE)
    assert content["shape"] == {"kind": "square", "size": 2.0}
    assert "kind" not in content["plain"]
    content["shape"]["kind"] = "circle"
    assert from_json(Whole, content).shape == Circle(2.0)


def test_an_integer_is_a_float_and_stays_one() -> None:
    loaded = from_json(Whole, to_json(WHOLE) | {"ratio": 2})
    assert loaded.ratio == 2.0
    assert isinstance(loaded.ratio, float)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"count": "3"}, "config.count: expected int, found '3'"),
        ({"count": 3.0}, "config.count: expected int, found 3.0"),
        ({"count": True}, "config.count: expected int, found True"),
        ({"count": None}, "config.count: expected int, found None"),
        ({"ratio": True}, "config.ratio: expected float, found True"),
        ({"ratio": "0.5"}, "config.ratio: expected float, found '0.5'"),
        ({"ratio": float("nan")}, "config.ratio: expected float, found nan"),
        ({"ratio": float("-inf")}, "config.ratio: expected float, found -inf"),
        ({"ratio": 10**400}, f"config.ratio: expected float, found 1{'0' * 56}..."),
        ({"ratio": 10**9000}, "config.ratio: expected float, found an integer of 29898 bits"),
        ({"on": 1}, "config.on: expected bool, found 1"),
        ({"text": 1}, "config.text: expected str, found 1"),
        ({"path": 1}, "config.path: expected Path, found 1"),
        ({"maybe": 1}, "config.maybe: expected Path, found 1"),
        ({"sizes": [1, "2"]}, "config.sizes[1]: expected int, found '2'"),
        ({"sizes": 1}, "config.sizes: expected tuple, found 1"),
        ({"mode": "idle"}, "config.mode: expected 'slow', 'fast', found 'idle'"),
        ({"mode": ["slow"]}, "config.mode: expected 'slow', 'fast', found ['slow']"),
        ({"free": []}, "config.free: expected dict, found []"),
        ({"plain": "p"}, "config.plain: expected the settings of Plain, found 'p'"),
        ({"plain": {"name": "p"}}, "config.plain: missing n"),
        ({"plain": {"name": "p", "n": 1, "m": 2}}, "config.plain: unknown m; known: name, n"),
        ({"plain": {"name": "p", "n": 0}}, "config.plain: n must be at least 1, not 0"),
        ({"parts": [{"name": "p", "n": "1"}]}, "config.parts[0].n: expected int, found '1'"),
        ({"shape": {"kind": "star"}}, "config.shape: kind is one of circle, square, found 'star'"),
        ({"shape": {"size": 1.0}}, "config.shape: kind is one of circle, square, found None"),
        ({"shape": {"kind": []}}, "config.shape: kind is one of circle, square, found []"),
        ({"shape": None}, "config.shape: kind is one of circle, square, found None"),
        ({"shape": {"kind": "circle", "side": 1.0}}, "config.shape: unknown side; known: size"),
    ],
)
def test_what_does_not_fit_is_named_with_its_place(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError) as caught:
        from_json(Whole, to_json(WHOLE) | changes)
    assert str(caught.value) == message


def test_every_missing_and_every_unknown_key_is_named() -> None:
    content = to_json(WHOLE) | {"zeta": 1, "alpha": 2}
    with pytest.raises(UserError, match="config: unknown alpha, zeta; known: shape, spare"):
        from_json(Whole, content)
    del content["zeta"], content["alpha"], content["text"], content["count"]
    with pytest.raises(UserError, match="config: missing count, text"):
        from_json(Whole, content)
    with pytest.raises(UserError, match="expected the settings of Whole, found \\[\\]"):
        from_json(Whole, [])


def test_a_config_of_another_kind_is_refused() -> None:
    with pytest.raises(UserError, match="expected kind 'circle', found 'square'"):
        from_json(Circle, to_json(Square()))


PPO = PPOConfig(n_envs=2, steps_per_round=64, batch_size=32, lr_schedule="linear", hidden=(), gamma=0.9)
WATCH = Watch(eval_every=3, tensorboard=False, checkpoint_every_s=0.5)
GAIL = GAILRun("Hopper-v5")
CHANGED = GAILRun(
    env_id="Ant-v5",
    env_kwargs=("ctrl_cost_weight=1",),
    demos="irl/ant/expert-v0",
    demo_episodes=2,
    demo_rate=20,
    steps=64,
    seed=9,
    out=Path("runs/x"),
    datasets_root=Path("data"),
    learner=PPO,
    discriminator=GAILConfig(hidden=(3, 4, 5), lr=1e-2, gradient_penalty=0.0),
    schedule=ScheduleConfig(batch_size=16, epochs=3, memory=100),
    watch=WATCH,
    device="cuda",
    threads=2,
    warm_start=WarmStartConfig(updates=7),
    preset="dac-paper",
    normaliser="mixed",
)
EXPERT = ExpertRun("Hopper-v5", "expert", 10, 1, Path("runs/e"), PPO, WATCH, "cpu", 1)


@pytest.mark.parametrize(
    "config",
    [
        *(GAIL, GAIL.resolved(), CHANGED, EXPERT),
        *(made("A-v1") for made in (GAILSACRun, GAILTD3Run, DACRun, DACTD3Run, BCRun)),
    ],
)
def test_the_settings_of_a_run_come_back_through_json(config: Any) -> None:
    assert through_json(config) == config
    assert to_json(config)["kind"] == config.KIND


def test_every_setting_that_differs_is_seen_in_the_json() -> None:
    before, after = to_json(GAIL), to_json(CHANGED)
    assert [name for name in before if before[name] == after[name]] == ["kind", "seeds"]
    # of a seed and several seeds only one is named
    assert to_json(replace(CHANGED, seed=0, seeds="1-2"))["seeds"] == "1-2"


def test_a_run_that_contradicts_itself_is_the_users_to_mend() -> None:
    content = to_json(GAIL)
    content["learner"]["steps_per_round"] = 100
    with pytest.raises(UserError, match=r"config\.learner: steps_per_round \(100\) must be a multiple"):
        from_json(GAILRun, content)
    with pytest.raises(UserError, match="config: steps must be at least 1, not 0"):
        from_json(GAILRun, to_json(GAIL) | {"steps": 0})
    with pytest.raises(UserError, match="expected kind 'expert', found 'gail'"):
        from_json(ExpertRun, to_json(GAIL))


def test_the_value_of_a_float_is_kept_to_the_bit() -> None:
    config = replace(GAIL, discriminator=GAILConfig(lr=math.nextafter(1e-3, 1)))
    assert through_json(config).discriminator.lr == math.nextafter(1e-3, 1)


def test_more_threads_than_any_machine_has_are_refused() -> None:
    for threads in (0, -1, 1025, 10**9):
        with pytest.raises(ValueError, match=f"threads must be in 1 to 1024, not {threads}"):
            GAILRun("Hopper-v5", threads=threads)


@dataclass(frozen=True)
class Grown:
    """Settings that became more: `wide` was in effect False, its default is True by now."""

    ADDED: ClassVar[dict[str, Any]] = {"wide": False, "names": ["a"]}
    size: int = 1
    wide: bool = True
    names: tuple[str, ...] = ()


def test_what_was_written_before_a_setting_existed_is_read_as_it_was_meant() -> None:
    assert from_json(Grown, {"size": 2}) == Grown(2, False, ("a",))
    assert from_json(Grown, {"size": 2, "wide": True, "names": []}) == Grown(2, True, ())
    with pytest.raises(UserError, match="missing size"):
        from_json(Grown, {})


def test_every_setting_that_was_added_is_one_and_of_its_type() -> None:
    seen = 0
    settings = (GAILConfig(), DACConfig(), AIRLConfig(), PPOConfig(), SACConfig())
    for config in (*settings, GAILRun("Task-v0"), DACRun("Task-v0"), AIRLRun("Task-v0")):
        added = config.ADDED
        seen += len(added)
        # a name that is no field, or a value of another type, is refused
        before = {name: value for name, value in to_json(config).items() if name not in added}
        read = from_json(type(config), before)
        for name, value in added.items():
            assert to_json(getattr(read, name)) == value
    assert seen > 20


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        (PPOConfig, "hidden"),
        (SACConfig, "hidden"),
        (ClonedConfig, "hidden"),
        (GAILConfig, "hidden"),
        (DACConfig, "hidden"),
        (AIRLConfig, "hidden"),
        (AIRLConfig, "potential_hidden"),
    ],
)
def test_a_layer_without_units_is_refused_and_no_layer_is_not(kind: type, name: str) -> None:
    for widths in ((0,), (64, -1)):
        with pytest.raises(ValueError, match=f"{name} must be widths of at least 1, not {widths[0]}"):
            kind(**{name: widths})
    assert getattr(kind(**{name: ()}), name) == ()
