"""A zip of Stable-Baselines3's acts as the model that wrote it, of any algorithm and age."""

import json
import zipfile
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import sb3_contrib
from stable_baselines3 import A2C, DDPG, DQN, PPO, SAC, TD3
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from irl.core.errors import UserError
from irl.envs.make import make
from irl.learners.sb3_import import load_sb3

OLD = Path(__file__).parent / "data" / "ppo_hopper_v4.zip"
"""Written by Stable-Baselines3 2.2.1, Gymnasium 0.29.1 and numpy 1.26.4, with VecNormalize, on Hopper-v4."""
OLD_ACTIONS = [
    [-0.006898922845721245, 0.008323033340275288, 0.015891559422016144],
    [0.018187467008829117, 0.02238367684185505, 0.022431081160902977],
    [0.00346727529540658, 0.022661592811346054, 0.01490236446261406],
    [0.008150518871843815, 0.016567733138799667, 0.015231997705996037],
    [-0.0020754272118210793, -0.00940976943820715, 0.0056640272960066795],
]
"""What that model itself predicted for `normal(size=(5, 11))` of seed 0, normalised by its statistics."""


def small() -> dict[str, Any]:
    """Settings; a dictionary of its own, because models write into it."""
    return {"policy_kwargs": {"net_arch": [8]}, "device": "cpu", "seed": 0}


def same(model, path: Path, env_id: str) -> None:
    model.save(path)
    env = make(env_id)
    acts = load_sb3(path, env)
    rng = np.random.default_rng(0)
    assert env.observation_space.shape is not None
    for obs in rng.normal(size=(20, *env.observation_space.shape)):
        expected = model.predict(obs.astype(np.float32), deterministic=True)[0]
        np.testing.assert_array_equal(acts(obs), expected)
    env.close()


@pytest.mark.parametrize("algorithm", [PPO, A2C, SAC, TD3, DDPG])
def test_real_actions(algorithm, tmp_path) -> None:
    same(algorithm("MlpPolicy", "Pendulum-v1", **small()), tmp_path / "a.zip", "Pendulum-v1")


@pytest.mark.parametrize("algorithm", [PPO, A2C, DQN])
def test_choices(algorithm, tmp_path) -> None:
    same(algorithm("MlpPolicy", "CartPole-v1", **small()), tmp_path / "a.zip", "CartPole-v1")


def test_gsde(tmp_path) -> None:
    same(PPO("MlpPolicy", "Pendulum-v1", use_sde=True, **small()), tmp_path / "a.zip", "Pendulum-v1")


@pytest.mark.parametrize("name", ["TQC", "TRPO", "ARS", "CrossQ", "QRDQN"])
def test_algorithms_of_sb3_contrib(name, tmp_path) -> None:
    task = "CartPole-v1" if name == "QRDQN" else "Pendulum-v1"
    same(getattr(sb3_contrib, name)("MlpPolicy", task, **small()), tmp_path / "a.zip", task)


def test_a_library_that_is_not_there_is_named(tmp_path, monkeypatch) -> None:
    sb3_contrib.TQC("MlpPolicy", "Pendulum-v1", **small()).save(tmp_path / "a.zip")
    modules = __import__("sys").modules
    for module in [name for name in modules if name.startswith("sb3_contrib")]:
        monkeypatch.setitem(modules, module, None)
    env = make("Pendulum-v1")
    with pytest.raises(UserError, match=r"needs sb3_contrib.*pip install sb3-contrib"):
        load_sb3(tmp_path / "a.zip", env)


def test_an_older_version_on_an_older_version_of_the_task() -> None:
    env = make("Hopper-v5")
    acts = load_sb3(OLD, env, OLD.with_suffix(".pkl"))
    for obs, expected in zip(np.random.default_rng(0).normal(size=(5, 11)), OLD_ACTIONS, strict=True):
        np.testing.assert_allclose(acts(obs), expected, atol=1e-6)
    env.close()


def test_spaces_of_another_dtype(tmp_path) -> None:
    class Single(gym.ObservationWrapper):
        def __init__(self, env: gym.Env) -> None:
            super().__init__(env)
            self.observation_space = gym.spaces.Box(-np.inf, np.inf, (11,), np.float32)

        def observation(self, observation: np.ndarray) -> np.ndarray:
            return observation.astype(np.float32)

    model = SAC("MlpPolicy", Single(gym.make("Hopper-v5")), **small())
    same(model, tmp_path / "a.zip", "Hopper-v5")


def test_statistics_change_what_is_seen(tmp_path) -> None:
    venv = VecNormalize(DummyVecEnv([lambda: gym.make("Pendulum-v1")]))
    venv.obs_rms.mean[:] = [0.3, -0.2, 1.0]  # pyright: ignore[reportAttributeAccessIssue]
    model = PPO("MlpPolicy", venv, **small())
    model.save(tmp_path / "a.zip")
    venv.save(str(tmp_path / "a.pkl"))
    env = make("Pendulum-v1")
    raw, normalised = load_sb3(tmp_path / "a.zip", env), load_sb3(tmp_path / "a.zip", env, tmp_path / "a.pkl")
    obs = np.array([0.5, 0.5, 2.0])
    seen = venv.normalize_obs(obs)
    assert isinstance(seen, np.ndarray)
    expected = model.predict(seen.astype(np.float32), deterministic=True)[0]
    np.testing.assert_array_equal(normalised(obs), expected)
    assert not np.array_equal(raw(obs), expected)
    hopper = make("Hopper-v5")
    with pytest.raises(UserError, match="holds no statistics"):
        load_sb3(OLD, hopper, tmp_path / "a.pkl")


def test_what_cannot_act_here_is_one_line(tmp_path) -> None:
    cheetah, pendulum = make("HalfCheetah-v5"), make("Pendulum-v1")

    def refused(path: Path, env: gym.Env, said: str) -> None:
        with pytest.raises(UserError, match=said) as caught:
            load_sb3(path, env)
        assert "\n" not in str(caught.value)

    refused(OLD, cheetah, r"trained on observations of \[11\], the task has \[17\]")
    refused(tmp_path / "no.zip", cheetah, "no file")
    (tmp_path / "text.zip").write_text("hello")
    refused(tmp_path / "text.zip", cheetah, "is no zip of Stable-Baselines3's")
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as archive:
        archive.writestr("data", json.dumps({"a": 1}))
    refused(tmp_path / "other.zip", cheetah, "names no policy_class")
    model = PPO(
        "MlpPolicy",
        gym.wrappers.RescaleAction(gym.make("Pendulum-v1"), np.float32(-1), np.float32(1)),
        **small(),
    )
    model.save(tmp_path / "scaled.zip")
    refused(tmp_path / "scaled.zip", pendulum, r"actions whose low is \[-1.\], the task's is \[-2.\]")
    with zipfile.ZipFile(OLD) as old, zipfile.ZipFile(tmp_path / "torn.zip", "w") as torn:
        for name in ("data", "pytorch_variables.pth"):
            torn.writestr(name, old.read(name))
    refused(tmp_path / "torn.zip", make("Hopper-v5"), "holds no policy that can be made")


def test_only_the_policy_is_unpickled(tmp_path, monkeypatch) -> None:
    import cloudpickle

    read, loads = [], cloudpickle.loads
    monkeypatch.setattr(cloudpickle, "loads", lambda content: (read.append(1), loads(content))[1])
    env = make("Hopper-v5")
    load_sb3(OLD, env)
    # the class; the settings of this one are JSON
    assert len(read) == 1


def test_a_recurrent_policy_is_refused_with_the_reason_and_what_to_use(tmp_path) -> None:
    task = gym.make("Pendulum-v1")
    sb3_contrib.RecurrentPPO("MlpLstmPolicy", task, n_steps=8, batch_size=8).save(tmp_path / "a.zip")
    with pytest.raises(UserError, match=r"remembers what it saw.*--policy module:function"):
        load_sb3(tmp_path / "a.zip", task)
