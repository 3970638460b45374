"""A policy as a zip of Stable-Baselines3: loaded by its own `load`, it predicts what the policy does."""

import io
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from stable_baselines3 import PPO, SAC, TD3

from irl.core.nets import NO_CLIP, Normaliser, fitted_normaliser
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.learners.sb3_export import ALGORITHMS, sb3_zip
from irl.policies.policy import Policy, PolicySpec
from tests import pointmass

LOW, HIGH = np.array([-1.0, 0.5], dtype=np.float32), np.array([3.0, 0.75], dtype=np.float32)
OBS = Box(-np.inf, np.inf, (3,), np.float64)
ACTION = Box(LOW, HIGH)
DRAWN = ["gaussian", "squashed_gaussian"]
KINDS = [*DRAWN, "deterministic"]


def policy(kind: str, hidden: tuple[int, ...] = (8, 5), activation: str = "tanh", **changes) -> Policy:
    """A policy of random weights, wide enough to reach both bounds, which are not symmetric."""
    rng = np.random.default_rng(3)
    sizes = (3, *hidden, 2)
    weights = {"obs_mean": rng.normal(size=3), "obs_std": rng.uniform(0.1, 3.0, 3)}
    weights |= {"action_low": LOW, "action_high": HIGH}
    for i in range(len(sizes) - 1):
        weights[f"layers.{i}.weight"] = rng.normal(size=(sizes[i + 1], sizes[i]))
        weights[f"layers.{i}.bias"] = rng.normal(size=sizes[i + 1])
    if kind == "gaussian":
        weights["log_std"] = rng.normal(size=2)
    elif kind == "squashed_gaussian":
        weights |= {"log_std.weight": rng.normal(size=(2, sizes[-2])), "log_std.bias": rng.normal(size=2)}
    weights = {name: value for name, value in (weights | changes).items() if value is not None}
    return Policy(PolicySpec("Any-v0", 3, 2, hidden, activation, kind), weights)


def loaded(content: bytes, kind: str, **more) -> PPO | SAC | TD3:
    return ALGORITHMS[kind].load(io.BytesIO(content), device="cpu", **more)


def random_state() -> np.ndarray:
    return np.asarray(np.random.get_state(legacy=False)["state"]["key"])  # noqa: NPY002


def same_actions(ours: Policy, theirs: PPO | SAC | TD3, n: int = 200) -> set[str]:
    """Checks that they act alike; which bounds were reached."""
    obs = ours.weights["obs_mean"] + 4.0 * np.random.default_rng(0).normal(size=(n, ours.spec.obs_dim))
    acted = np.array([ours(row) for row in obs])
    for row, action in zip(obs, acted, strict=True):
        predicted, _ = theirs.predict(row, deterministic=True)
        np.testing.assert_allclose(predicted, action, atol=1e-5)
    predicted, _ = theirs.predict(obs, deterministic=True)
    np.testing.assert_allclose(predicted, acted, atol=1e-5)
    low, high = ours.weights["action_low"], ours.weights["action_high"]
    assert (acted.std(0) > 1e-3).all()
    reached = {"low": np.isclose(acted, low, atol=1e-2), "high": np.isclose(acted, high, atol=1e-2)}
    return {name for name, where in reached.items() if where.any()}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("hidden", "activation"), [((8, 5), "tanh"), ((7,), "relu"), ((), "tanh")])
def test_the_zip_predicts_what_the_policy_does(kind: str, hidden: tuple[int, ...], activation: str) -> None:
    ours = policy(kind, hidden, activation)
    theirs = loaded(sb3_zip(ours, OBS, ACTION), kind)
    assert type(theirs) is ALGORITHMS[kind]
    assert same_actions(ours, theirs) == {"low", "high"}
    # critics see what the actor sees
    means = [v for name, v in theirs.policy.state_dict().items() if name.endswith("normaliser.mean")]
    assert len(means) >= (1 if kind == "gaussian" else 3)
    for mean in means:
        np.testing.assert_array_equal(mean.numpy(), ours.weights["obs_mean"])


@pytest.mark.parametrize("kind", DRAWN)
def test_its_samples_spread_as_the_policys_do(kind: str) -> None:
    ours = policy(kind)
    theirs = loaded(sb3_zip(ours, OBS, ACTION), kind)
    rng, obs = np.random.default_rng(1), ours.weights["obs_mean"].astype(np.float64)
    drawn = np.array([ours.sample(obs, rng) for _ in range(4000)])
    predicted, _ = theirs.predict(np.tile(obs, (4000, 1)), deterministic=False)
    np.testing.assert_allclose(predicted.mean(0), drawn.mean(0), atol=0.1)
    np.testing.assert_allclose(predicted.std(0), drawn.std(0), rtol=0.1)


def test_a_squashed_policy_of_one_deviation_keeps_it() -> None:
    log_std = np.array([-1.0, 0.5])
    ours = policy("squashed_gaussian", **{"log_std": log_std, "log_std.weight": None, "log_std.bias": None})
    theirs = loaded(sb3_zip(ours, OBS, ACTION), "squashed_gaussian")
    same_actions(ours, theirs)
    assert isinstance(theirs, SAC)
    _, given, _ = theirs.actor.get_action_dist_params(torch.randn(5, 3))
    np.testing.assert_allclose(given.detach().numpy(), np.tile(log_std, (5, 1)), rtol=1e-6)


@pytest.mark.parametrize("absorbing_scale", [0.0, 10.0])
def test_a_trained_sac_policy_acts_the_same_with_and_without_an_absorbing_state(
    absorbing_scale: float,
) -> None:
    config = SACConfig(steps_per_round=100, learning_starts=50, batch_size=32, hidden=(16,))
    normaliser = fitted_normaliser(torch.randn(50, 3) * 0.3 + 1.0)
    learner = SACLearner(
        "Pendulum-v1",
        [0],
        config,
        seed=0,
        total_steps=100,
        normaliser=normaliser,
        absorbing_scale=absorbing_scale,
    )
    learner.start(lambda batch: batch.obs[:, 0])
    learner.collect()
    ours = learner.policy()
    learner.close()
    spaces = gym.make("Pendulum-v1")
    assert isinstance(spaces.observation_space, Box)
    assert isinstance(spaces.action_space, Box)
    content = sb3_zip(ours, spaces.observation_space, spaces.action_space)
    same_actions(ours, loaded(content, "squashed_gaussian", env=spaces))
    spaces.close()


def same_everywhere(ours: Policy, theirs: PPO | SAC | TD3, obs: np.ndarray) -> None:
    for row in obs:
        predicted, _ = theirs.predict(row, deterministic=True)
        np.testing.assert_allclose(predicted, ours(row), atol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("clip", [0.5, 10.0, NO_CLIP])
def test_the_bound_of_observations_goes_into_the_zip(kind: str, clip: float) -> None:
    ours = policy(kind, obs_clip=np.array(clip))
    content = sb3_zip(ours, OBS, ACTION)
    same_everywhere(ours, loaded(content, kind), 50.0 * np.random.default_rng(0).normal(size=(20, 3)))


@pytest.mark.parametrize("absorbing_scale", [0.0, 10.0])
@pytest.mark.parametrize("normaliser", [None, Normaliser(3, clip=4.0)])
def test_a_sac_policy_acts_on_observations_of_50_as_its_own_model_does(
    normaliser: Normaliser | None, absorbing_scale: float
) -> None:
    config = SACConfig(steps_per_round=100, learning_starts=50, batch_size=32, hidden=(16,))
    more = {"normaliser": normaliser, "absorbing_scale": absorbing_scale}
    learner = SACLearner("Pendulum-v1", [0], config, seed=0, total_steps=100, **more)
    learner.start(lambda batch: batch.obs[:, 0])
    learner.collect()
    ours, venv = learner.policy(), learner.venv
    assert isinstance(venv.observation_space, Box)
    assert isinstance(venv.action_space, Box)
    content = sb3_zip(ours, venv.observation_space, venv.action_space)
    learner.close()
    obs = np.array([[50.0, 0, 0], [0, -50.0, 0], [0, 0, 50.0], [12.0, -50.0, 20.0]], dtype=np.float32)
    # the learner's own networks see the indicator of the absorbing state too
    own = np.pad(obs, ((0, 0), (0, int(absorbing_scale > 0))))
    expected, _ = learner.model.predict(own, deterministic=True)
    np.testing.assert_allclose([ours(row) for row in obs], expected, atol=1e-5)
    same_everywhere(ours, loaded(content, "squashed_gaussian"), obs)


def test_a_trained_ppo_policy_acts_the_same() -> None:
    config = PPOConfig(n_envs=2, steps_per_round=128, batch_size=64, n_epochs=2, hidden=(8,))
    learner = PPOLearner("PointMass-v0", [0, 1], config, seed=0, total_steps=128)
    learner.collect()
    learner.improve(lambda batch: -batch.next_obs.norm(dim=1))
    ours, venv = learner.policy(), learner.venv
    assert isinstance(venv.observation_space, Box)
    assert isinstance(venv.action_space, Box)
    content = sb3_zip(ours, venv.observation_space, venv.action_space)
    learner.close()
    same_actions(ours, loaded(content, "gaussian"))


@pytest.mark.parametrize("kind", KINDS)
def test_it_can_be_trained_further(kind: str, tmp_path: Path) -> None:
    env = gym.make("Pendulum-v1")
    box = env.action_space
    assert isinstance(box, Box)
    assert isinstance(env.observation_space, Box)
    ours = policy(kind)
    weights = {name: value for name, value in ours.weights.items() if not name.startswith("action_")}
    weights |= {"layers.2.weight": weights["layers.2.weight"][:1], "layers.2.bias": np.zeros(1)}
    for name in [name for name in weights if name.startswith("log_std")]:
        weights[name] = weights[name][:1]
    weights |= {"action_low": box.low, "action_high": box.high}
    one = Policy(PolicySpec("Pendulum-v1", 3, 1, (8, 5), "tanh", kind), weights)
    (tmp_path / "policy.zip").write_bytes(sb3_zip(one, env.observation_space, box))
    quick = {"gaussian": {"n_steps": 64, "batch_size": 32}, "squashed_gaussian": {"learning_starts": 10}}
    quick["deterministic"] = quick["squashed_gaussian"]
    changes: dict[str, Any] = quick[kind]
    model = ALGORITHMS[kind].load(tmp_path / "policy.zip", env=env, device="cpu", **changes)
    before = {name: value.clone() for name, value in model.policy.state_dict().items()}
    model.learn(64)
    after = model.policy.state_dict()
    moved = {name for name in before if not torch.equal(before[name], after[name])}
    assert moved
    assert not [name for name in moved if "normaliser" in name]


@pytest.mark.parametrize("kind", KINDS)
def test_the_global_streams_are_left_where_they_were(kind: str) -> None:
    before = torch.get_rng_state(), random_state()
    sb3_zip(policy(kind), OBS, ACTION)
    assert torch.equal(before[0], torch.get_rng_state())
    np.testing.assert_array_equal(before[1], random_state())


def test_what_the_networks_cannot_be_is_refused() -> None:
    gaussian = policy("gaussian")
    with pytest.raises(ValueError, match="observations of 3"):
        sb3_zip(gaussian, Box(-1.0, 1.0, (2,)), ACTION)
    with pytest.raises(ValueError, match="action_high"):
        sb3_zip(gaussian, OBS, Box(LOW, HIGH + 1.0))
    with pytest.raises(ValueError, match="obs_std"):
        sb3_zip(policy("gaussian", obs_std=np.array([1.0, 1e-9, 1.0])), OBS, ACTION)
    of_state = {"log_std": None, "log_std.weight": np.zeros((2, 5)), "log_std.bias": np.zeros(2)}
    with pytest.raises(ValueError, match="depends on the observation"):
        sb3_zip(policy("gaussian", **of_state), OBS, ACTION)


def test_the_point_masss_expert_with_no_hidden_layer_is_a_zip_too() -> None:
    ours = pointmass.expert()
    content = sb3_zip(ours, Box(-1.5, 1.5, (2,), np.float64), Box(-1.0, 1.0, (2,)))
    same_actions(ours, loaded(content, "gaussian"))
