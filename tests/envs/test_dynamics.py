"""Other dynamics, by name: what is changed is changed by its factor, and nothing else is."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from gymnasium.spaces import Box

from irl.core.errors import UserError
from irl.envs import dynamics
from irl.envs.dynamics import named
from irl.envs.make import make
from irl.envs.names import full_name
from irl.envs.rollouts import random_act, rollout


def model(env_id: str, **changes: float) -> Any:
    env = make(env_id, dynamics=changes) if changes else make(env_id)
    found = env.unwrapped.model  # pyright: ignore[reportAttributeAccessIssue]
    env.close()
    return found


KEPT = ("body_mass", "body_inertia", "dof_damping", "geom_friction", "geom_size", "body_pos", "actuator_gear")


def same(a: Any, b: Any, *but: str) -> bool:
    kept = [name for name in KEPT if name not in but]
    gravity = "gravity" in but or np.array_equal(a.opt.gravity, b.opt.gravity)
    return gravity and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in kept)


@pytest.mark.parametrize("env_id", ["Hopper-v5", "HalfCheetah-v5", "Walker2d-v5", "Ant-v5"])
def test_each_factor_changes_what_it_names_and_nothing_else(env_id: str) -> None:
    own = model(env_id)
    heavy = model(env_id, mass=1.5)
    np.testing.assert_allclose(heavy.body_mass, 1.5 * own.body_mass, rtol=1e-6)
    np.testing.assert_allclose(heavy.body_inertia, 1.5 * own.body_inertia, rtol=1e-6)
    assert same(own, heavy, "body_mass", "body_inertia")
    light = model(env_id, gravity=0.5)
    np.testing.assert_allclose(light.opt.gravity, 0.5 * own.opt.gravity)
    assert same(own, light, "gravity")
    slippery = model(env_id, friction=0.25)
    np.testing.assert_allclose(slippery.geom_friction[:, 0], 0.25 * own.geom_friction[:, 0])
    np.testing.assert_array_equal(slippery.geom_friction[:, 1:], own.geom_friction[:, 1:])
    assert same(own, slippery, "geom_friction")
    stiff = model(env_id, damping=3.0)
    np.testing.assert_allclose(stiff.dof_damping, 3.0 * own.dof_damping)
    assert own.dof_damping.any()
    assert same(own, stiff, "dof_damping")


def test_two_legs_of_the_ant_are_short_and_have_no_motor() -> None:
    own, lame = model("Ant-v5"), model("Ant-v5", disabled_legs=2)
    assert (lame.actuator_gear[:, 0] == 0).sum() == 4
    assert lame.nu == own.nu
    joints = {
        lame.joint(lame.actuator_trnid[i, 0]).name for i in np.flatnonzero(lame.actuator_gear[:, 0] == 0)
    }
    assert joints == {"hip_1", "ankle_1", "hip_2", "ankle_2"}
    for name, factor in (("left_ankle_geom", 0.5), ("right_leg_geom", 0.5), ("third_ankle_geom", 1.0)):
        # of a capsule, half its length
        np.testing.assert_allclose(lame.geom(name).size[1], factor * own.geom(name).size[1], rtol=1e-6)
    np.testing.assert_array_equal(lame.opt.gravity, own.opt.gravity)


def test_a_factor_of_1_is_the_task_itself_and_two_makings_are_one() -> None:
    def played(env_id: str) -> np.ndarray:
        env = make(env_id)
        episode = rollout(env, random_act(env.action_space, np.random.default_rng(0)), 3)
        env.close()
        return episode.obs

    own, heavy = "Hopper-v5", full_name("Hopper-v5", ('{"dynamics": {"mass": 1.5, "gravity": 0.8}}',))
    unchanged = full_name(own, ('{"dynamics": {"mass": 1.0, "friction": 1, "damping": 1.0, "gravity": 1}}',))
    np.testing.assert_array_equal(played(own), played(unchanged))
    np.testing.assert_array_equal(played(heavy), played(heavy))
    assert not np.array_equal(played(own)[:5], played(heavy)[:5])


def test_typed_changes_keep_their_kind_in_the_name() -> None:
    assert full_name("Ant-v5", named(("disabled_legs=2",))) == 'Ant-v5?{"dynamics":{"disabled_legs":2}}'
    assert full_name("Hopper-v5", named(("mass=1.5",))) == 'Hopper-v5?{"dynamics":{"mass":1.5}}'
    assert named(()) == ()


def test_no_file_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    env = make("Hopper-v5", dynamics={"mass": 2.0})
    env.close()
    assert list(tmp_path.iterdir()) == []
    assert env.spec is not None
    assert env.spec.kwargs == {"dynamics": {"mass": 2.0}}
    with pytest.raises(UserError, match="xml_file and dynamics"):
        make("Hopper-v5", dynamics={"mass": 2.0}, xml_file="mine.xml")


@pytest.mark.parametrize(
    ("env_id", "changes", "said"),
    [
        ("Hopper-v5", {"mass": 0.0}, "mass=0.0"),
        ("Hopper-v5", {"weight": 2.0}, "weight=2.0"),
        ("Hopper-v5", {"mass": True}, "mass=True"),
        ("Hopper-v5", {"mass": float("nan")}, "mass=nan"),
        ("Hopper-v5", {"disabled_legs": 2}, "disabled_legs=2"),
        ("Hopper-v5", 3, "dynamics is 3"),
        ("Ant-v5", {"disabled_legs": 4}, "disabled_legs=4"),
        ("Pendulum-v1", {"mass": 2.0}, "no MuJoCo task"),
        ("Swimmer-v5", {"damping": 2.0}, "model's damping is 0"),
        ("Pusher-v5", {"gravity": 2.0}, "model's gravity is 0"),
        ("Swimmer-v5", {"gravity": 0.5}, "no joint of Swimmer-v5 feels gravity"),
        ("Reacher-v5", {"gravity": 0.5, "mass": 2.0}, "no joint of Reacher-v5 feels gravity"),
        ("Swimmer-v5", {"friction": 2.0}, "nothing of Swimmer-v5 touches with friction"),
        ("Reacher-v5", {"friction": 2.0}, "nothing of Reacher-v5 touches with friction"),
        ("Pusher-v5", {"friction": 2.0}, "nothing of Pusher-v5 touches with friction"),
        ("InvertedPendulum-v5", {"friction": 2.0}, "nothing of InvertedPendulum-v5 touches"),
        ("InvertedDoublePendulum-v5", {"friction": 2.0}, "nothing of InvertedDoublePendulum-v5 touches"),
    ],
)
def test_what_is_no_change_is_one_line(env_id: str, changes: Any, said: str) -> None:
    with pytest.raises(UserError, match=said):
        make(env_id, dynamics=changes)


def played(env_id: str, changes: dict[str, float] | None = None) -> np.ndarray:
    """The states of forty random steps, whatever ends on the way."""
    env = make(env_id, dynamics=changes) if changes else make(env_id)
    base, rng = env.unwrapped, np.random.default_rng(0)
    base.reset(seed=0)
    box = env.action_space
    assert isinstance(box, Box)
    steps = [base.step(rng.uniform(box.low, box.high).astype(np.float32))[0] for _ in range(40)]
    env.close()
    return np.array(steps)


@pytest.mark.parametrize("name", ["gravity", "friction"])
@pytest.mark.parametrize(
    "env_id",
    [
        *("Hopper-v5", "HalfCheetah-v5", "Walker2d-v5", "Ant-v5", "Humanoid-v5", "Swimmer-v5", "Reacher-v5"),
        *("InvertedPendulum-v5", "InvertedDoublePendulum-v5"),
    ],
)
def test_a_change_is_refused_just_where_no_step_would_differ(
    env_id: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    try:
        make(env_id, dynamics={name: 0.5}).close()
        refused = False
    except UserError:
        refused = True
    monkeypatch.setattr("irl.envs.make.check_felt", lambda *_: None)
    assert refused == np.array_equal(played(env_id), played(env_id, {name: 0.5}))


def test_two_geometries_of_an_explicit_pair_touch_whatever_their_masks() -> None:
    geoms = """<worldbody><geom type="plane" size="1 1 1" name="a" contype="0" conaffinity="0"/>
        <body><freejoint/><geom size="0.1" name="b" contype="0" conaffinity="0"/></body></worldbody>"""
    for condim, rubs in ((1, False), (3, True)):
        pair = f'<contact><pair geom1="a" geom2="b" condim="{condim}"/></contact>'
        own = getattr(mujoco, "MjModel").from_xml_string(f"<mujoco>{geoms}{pair}</mujoco>")  # noqa: B009
        assert dynamics._rubs(own) == rubs
