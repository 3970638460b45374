import json
import pickle
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import load, load_file, save

from irl.core.errors import UserError
from irl.core.nets import NO_CLIP
from irl.core.rng import stream
from irl.core.types import ActFn
from irl.envs.make import make
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.policies.policy import (
    FORMAT,
    VERSION,
    Policy,
    PolicySpec,
    check_policy,
    load_policy,
    save_policy,
)
from irl.rewards.mujoco import HandWritten

LOW, HIGH = np.array([-0.5, -2.0]), np.array([0.5, 1.0])
DISTRIBUTIONS = ("gaussian", "squashed_gaussian")


def spec(
    hidden: tuple[int, ...] = (6, 5), activation: str = "tanh", distribution: str = "gaussian"
) -> PolicySpec:
    return PolicySpec("Test-v0", 3, 2, hidden, activation, distribution)


def weights_of(spec: PolicySpec, *, state_dependent: bool = False, seed: int = 0) -> dict[str, np.ndarray]:
    rng = stream(seed, "weights")
    sizes = (spec.obs_dim, *spec.hidden, spec.action_dim)
    weights = {"obs_mean": rng.normal(size=3), "obs_std": rng.uniform(0.5, 2, 3)}
    weights |= {"action_low": LOW, "action_high": HIGH}
    for i, (inputs, outputs) in enumerate(pairwise(sizes)):
        weights |= {f"layers.{i}.weight": rng.normal(size=(outputs, inputs)) / np.sqrt(inputs)}
        weights |= {f"layers.{i}.bias": 0.1 * rng.normal(size=outputs)}
    if state_dependent:
        weights |= {"log_std.weight": rng.normal(size=(2, sizes[-2])), "log_std.bias": rng.normal(size=2)}
    else:
        weights["log_std"] = np.array([-1.0, -2.0])
    return weights


def a_policy(**changes: Any) -> Policy:
    return Policy(spec(**changes), weights_of(spec(**changes)))


def slow_mean(policy: Policy, obs: np.ndarray) -> tuple[list[float], list[float]]:
    """The last features and the mean before the bounds, one number after the other in float64."""
    w = {name: value.astype(np.float64) for name, value in policy.weights.items()}
    c = float(w.get("obs_clip", 10.0))
    x = [min(max((o - m) / s, -c), c) for o, m, s in zip(obs, w["obs_mean"], w["obs_std"], strict=True)]
    act = np.tanh if policy.spec.activation == "tanh" else lambda v: max(v, 0.0)
    depth = len(policy.spec.hidden)
    features = x
    for i in range(depth + 1):
        features = x
        rows = zip(w[f"layers.{i}.weight"], w[f"layers.{i}.bias"], strict=True)
        x = [sum(a * b for a, b in zip(row, features, strict=True)) + bias for row, bias in rows]
        x = [float(act(v)) for v in x] if i < depth else x
    return features, x


def slow_bounds(policy: Policy, action: list[float]) -> list[float]:
    bounds = list(zip(action, LOW, HIGH, strict=True))
    if policy.spec.distribution == "gaussian":
        return [min(max(a, low), high) for a, low, high in bounds]
    return [low + (np.tanh(a) + 1) / 2 * (high - low) for a, low, high in bounds]


@pytest.mark.parametrize("hidden", [(), (4,), (6, 5)])
@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_the_action_is_the_formulas(hidden, activation, distribution) -> None:
    policy: ActFn = a_policy(hidden=hidden, activation=activation, distribution=distribution)
    assert isinstance(policy, Policy)
    for obs in stream(0, "obs").normal(0, 3, (20, 3)):
        expected = slow_bounds(policy, slow_mean(policy, obs)[1])
        np.testing.assert_allclose(policy(obs), expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
@given(scale=st.floats(0, 1e6), seed=st.integers(0, 100))
def test_actions_stay_within_the_bounds(distribution: str, scale: float, seed: int) -> None:
    policy, rng = a_policy(distribution=distribution), stream(seed, "obs")
    obs = scale * rng.normal(size=3)
    slack = 1e-6
    for action in (policy(obs), policy.sample(obs, rng)):
        assert action.shape == (2,)
        assert ((action >= LOW - slack) & (action <= HIGH + slack)).all()


def test_the_bounds_are_met_and_the_observations_clipped() -> None:
    hand = weights_of(spec(hidden=()))
    hand |= {"layers.0.weight": np.array([[5.0, 0, 0], [0, 0.01, 0]]), "layers.0.bias": np.zeros(2)}
    hand |= {"obs_mean": np.zeros(3), "obs_std": np.ones(3)}
    policy = Policy(spec(hidden=()), hand)
    np.testing.assert_allclose(policy(np.array([9.0, 1.0, 0])), [0.5, 0.01], rtol=1e-6)
    np.testing.assert_allclose(policy(np.array([-9.0, 1e9, 0])), [-0.5, 0.1], rtol=1e-6)


@pytest.mark.parametrize("clip", [2.0, NO_CLIP])
def test_a_bound_of_its_own_is_the_formulas_and_comes_back_from_the_file(tmp_path: Path, clip: float) -> None:
    kind = spec(activation="relu")
    wide = weights_of(kind) | {"action_low": np.full(2, -1e3), "action_high": np.full(2, 1e3)}
    policy = Policy(kind, wide | {"obs_clip": np.array(clip)})
    save_policy(policy, tmp_path / "p.safetensors")
    loaded = load_policy(tmp_path / "p.safetensors")
    assert loaded.weights["obs_clip"].shape == ()
    assert float(loaded.weights["obs_clip"]) == clip
    moved = 0.0
    for obs in stream(0, "obs").normal(0, 50, (20, 3)):
        np.testing.assert_allclose(policy(obs), slow_mean(policy, obs)[1], rtol=1e-5, atol=1e-4)
        np.testing.assert_array_equal(loaded(obs), policy(obs))
        moved = max(moved, float(np.abs(policy(obs) - Policy(kind, wide)(obs)).max()))
    # the bound of 10 is another policy
    assert moved > 1.0


def test_without_a_bound_of_its_own_a_policy_is_the_file_it_always_was(tmp_path: Path) -> None:
    save_policy(a_policy(), tmp_path / "p.safetensors")
    assert "obs_clip" not in load_file(tmp_path / "p.safetensors")
    hand = weights_of(spec())
    far = np.array([1e3, -1e3, 1e3])
    ten = Policy(spec(), hand | {"obs_clip": np.array(10.0)})
    np.testing.assert_array_equal(a_policy()(far), ten(far))


@pytest.mark.parametrize(
    ("bound", "message"),
    [(0.0, "obs_clip has values that are not positive"), (np.inf, "obs_clip has values that are not finite")],
)
def test_a_bound_that_no_training_writes_is_refused(tmp_path: Path, bound: float, message: str) -> None:
    save_policy(Policy(spec(), weights_of(spec()) | {"obs_clip": np.array(bound)}), tmp_path / "p")
    with pytest.raises(UserError, match=message):
        load_policy(tmp_path / "p")


def test_samples_of_a_gaussian_have_its_mean_and_deviation() -> None:
    wide = weights_of(spec()) | {"action_low": np.full(2, -1e3), "action_high": np.full(2, 1e3)}
    policy, rng, obs = Policy(spec(), wide), stream(0, "noise"), np.array([0.3, -1.0, 0.5])
    drawn = np.array([policy.sample(obs, rng) for _ in range(2000)])
    std = np.exp([-1.0, -2.0])
    # five standard errors of a mean and of a deviation
    np.testing.assert_allclose(drawn.mean(0), policy(obs), atol=5 * std.max() / np.sqrt(2000))
    np.testing.assert_allclose(drawn.std(0), std, rtol=5 / np.sqrt(4000))
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 5 / np.sqrt(2000)


def test_samples_of_a_squashed_gaussian_are_gaussian_before_the_squashing() -> None:
    kind = spec(distribution="squashed_gaussian")
    policy = Policy(kind, weights_of(kind, state_dependent=True))
    rng, obs = stream(0, "noise"), np.array([0.3, -1.0, 0.5])
    features, mean = slow_mean(policy, obs)
    w = policy.weights
    std = np.exp(w["log_std.weight"] @ np.array(features) + w["log_std.bias"])
    drawn = np.array([policy.sample(obs, rng) for _ in range(2000)], dtype=np.float64)
    before = np.arctanh(np.clip(2 * (drawn - LOW) / (HIGH - LOW) - 1, -1 + 1e-7, 1 - 1e-7))
    # quantiles, because the tails saturate: the median and the middle 68 %
    low, middle, high = np.quantile(before, [0.1587, 0.5, 0.8413], axis=0)
    np.testing.assert_allclose((middle - mean) / std, 0, atol=0.15)
    np.testing.assert_allclose((high - low) / 2 / std, 1, atol=0.15)


def test_a_state_dependent_deviation_is_kept_within_sb3s_bounds() -> None:
    given = weights_of(spec(), state_dependent=True)
    given |= {
        "log_std.weight": np.zeros((2, 5)),
        "action_low": np.full(2, -1e3),
        "action_high": np.full(2, 1e3),
    }
    obs, spread = np.zeros(3), []
    for bias in (-50.0, 50.0):
        policy, rng = Policy(spec(), given | {"log_std.bias": np.full(2, bias)}), stream(0, "noise")
        spread.append(np.std([policy.sample(obs, rng) for _ in range(500)]))
    assert spread[0] < 1e-6 + np.ptp(a_policy()(obs))
    assert spread[1] == pytest.approx(np.exp(2.0), rel=0.15)


def test_samples_are_the_generators() -> None:
    policy, obs = a_policy(), np.zeros(3)
    first = policy.sample(obs, stream(0, "a"))
    np.testing.assert_array_equal(policy.sample(obs, stream(0, "a")), first)
    assert (policy.sample(obs, stream(1, "a")) != first).all()
    np.testing.assert_array_equal(policy(obs), policy(obs))


@pytest.mark.parametrize("hidden", [(), (6, 5)])
@pytest.mark.parametrize("state_dependent", [True, False])
@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_a_loaded_policy_acts_the_same_to_the_bit(tmp_path, hidden, state_dependent, distribution) -> None:
    kind = spec(hidden=hidden, distribution=distribution)
    policy = Policy(kind, weights_of(kind, state_dependent=state_dependent))
    save_policy(policy, tmp_path / "p.safetensors")
    loaded = load_policy(str(tmp_path / "p.safetensors"))
    assert loaded.spec == kind
    for obs in stream(0, "obs").normal(0, 3, (20, 3)):
        np.testing.assert_array_equal(loaded(obs), policy(obs))
        np.testing.assert_array_equal(loaded.sample(obs, stream(0, "a")), policy.sample(obs, stream(0, "a")))


def test_any_reader_of_safetensors_finds_the_weights_and_what_they_mean(tmp_path: Path) -> None:
    save_policy(a_policy(), tmp_path / "p.safetensors")
    found = load_file(tmp_path / "p.safetensors")
    assert found.keys() == weights_of(spec()).keys()
    for name, value in weights_of(spec()).items():
        np.testing.assert_array_equal(found[name], value.astype(np.float32))
    with safe_open(tmp_path / "p.safetensors", framework="numpy") as file:
        assert json.loads(file.metadata()["irl"]) == HEADER


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"layers.0.weight": np.zeros((6, 4))}, r"layers.0.weight: expected shape \(6, 3\), found \(6, 4\)"),
        ({"layers.2.bias": np.zeros(3)}, r"layers.2.bias: expected shape \(2,\), found \(3,\)"),
        ({"obs_std": np.zeros(4)}, r"obs_std: expected shape \(3,\), found \(4,\)"),
        ({"obs_clip": np.ones(3)}, r"obs_clip: expected shape \(\), found \(3,\)"),
        ({"action_high": np.zeros(1)}, r"action_high: expected shape \(2,\), found \(1,\)"),
        ({"log_std": np.zeros(1)}, r"log_std: expected shape \(2,\), found \(1,\)"),
        ({"log_std": None}, r"log_std"),
        ({"layers.1.bias": None}, r"layers.1.bias: expected shape \(5,\), found None"),
        ({"layers.3.bias": np.zeros(2)}, "unexpected weights: .'layers.3.bias'"),
        (
            {"log_std": None, "log_std.weight": np.zeros((2, 4)), "log_std.bias": np.zeros(2)},
            r"log_std.weight: expected shape \(2, 5\), found \(2, 4\)",
        ),
        ({"log_std.bias": np.zeros(2)}, "unexpected weights: .'log_std.bias'"),
    ],
)
def test_weights_that_do_not_fit_are_refused_by_name(changes, message: str) -> None:
    given = {name: value for name, value in (weights_of(spec()) | changes).items() if value is not None}
    with pytest.raises(ValueError, match=message):
        Policy(spec(), given)


@pytest.mark.parametrize("changes", [{"activation": "gelu"}, {"distribution": "beta"}])
def test_an_unknown_kind_of_policy_is_refused(changes: dict[str, str]) -> None:
    with pytest.raises(
        ValueError, match=f"unknown activation or distribution.*{next(iter(changes.values()))}"
    ):
        a_policy(**changes)


SPEC: dict[str, Any] = {
    "env_id": "Test-v0",
    "obs_dim": 3,
    "action_dim": 2,
    "hidden": [6, 5],
    "activation": "tanh",
    "distribution": "gaussian",
}
HEADER: dict[str, Any] = {"format": FORMAT, "version": VERSION, "spec": SPEC}


def packed(header: Any) -> dict[str, str]:
    return {"irl": json.dumps(header)}


def changed_spec(**changes: Any) -> dict[str, Any]:
    return HEADER | {"spec": SPEC | changes}


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (HEADER | {"format": "irl.reward"}, "expected format irl.policy 1, found irl.reward 1"),
        (HEADER | {"version": 2}, "expected format irl.policy 1, found irl.policy 2"),
        ({}, "expected format irl.policy 1, found None None"),
        ([], "not a policy"),
        (HEADER | {"spec": "{"}, "not a policy"),
        (HEADER | {"spec": []}, "not a policy"),
        ({name: HEADER[name] for name in ("format", "version")}, "spec"),
        (changed_spec(extra=1), "extra"),
        (changed_spec(obs_dim=4), "obs_mean"),
        (changed_spec(hidden=[6]), r"layers\.1"),
        (changed_spec(hidden=7), "not a policy"),
        (changed_spec(activation="gelu"), "gelu"),
    ],
)
def test_a_file_that_says_it_is_something_else_is_refused(tmp_path: Path, header, message: str) -> None:
    path = tmp_path / "p.safetensors"
    content = {name: value.astype(np.float32) for name, value in weights_of(spec()).items()}
    path.write_bytes(save(content, metadata=packed(HEADER)))
    load_policy(path)
    path.write_bytes(save(content, metadata=packed(header)))
    with pytest.raises(UserError, match=message) as caught:
        load_policy(path)
    assert str(path) in str(caught.value)


def test_a_file_without_a_weight_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "p.safetensors"
    save_policy(a_policy(), path)
    content = load(path.read_bytes())
    for name in content:
        path.write_bytes(save({k: v for k, v in content.items() if k != name}, metadata=packed(HEADER)))
        with pytest.raises(UserError, match=name):
            load_policy(path)


def test_equal_policies_are_equal_files(tmp_path: Path) -> None:
    # a card knows its policy by the hash of the file
    for name in ("a", "b", "c", "d"):
        save_policy(a_policy(), tmp_path / name)
    assert len({(tmp_path / name).read_bytes() for name in ("a", "b", "c", "d")}) == 1


class Payload:
    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return Path.touch, (self.mark,)


def test_a_truncated_missing_or_foreign_file_is_the_users_to_mend(tmp_path: Path) -> None:
    path = tmp_path / "p.safetensors"
    with pytest.raises(UserError, match=r"no policy file .*p\.safetensors"):
        load_policy(path)
    save_policy(a_policy(), path)
    whole = path.read_bytes()
    foreign = [b"hello", pickle.dumps(Payload(tmp_path / "ran"))]
    for content in [*(whole[:n] for n in (0, 7, 100, len(whole) - 1)), *foreign]:
        path.write_bytes(content)
        with pytest.raises(UserError, match=r"p\.safetensors is not a policy"):
            load_policy(path)
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("hidden", [(), (8, 6)])
def test_an_exported_ppo_acts_as_sb3_does(hidden: tuple[int, ...]) -> None:
    config = PPOConfig(n_envs=2, steps_per_round=64, batch_size=32, n_epochs=2, lr=3e-2, hidden=hidden)
    learner = PPOLearner("Hopper-v5", [1, 2], config, seed=0, total_steps=64)
    try:
        batch = learner.collect()
        learner.improve(HandWritten())
        policy, model = learner.policy(), learner.model
        obs = np.concatenate([batch.obs.numpy(), 30 * stream(0, "obs").normal(size=(50, 11))])
        expected = model.predict(obs.astype(np.float32), deterministic=True)[0]
        found = np.array([policy(row) for row in obs.astype(np.float32)])
        np.testing.assert_allclose(found, expected, atol=2e-5)
        # neither constant nor pinned at the bounds, and not the normaliser's start
        assert (np.abs(found) < 1).mean() > 0.2
        assert found.std(0).min() > 1e-3
        assert np.abs(policy.weights["obs_mean"]).max() > 0.1
        first = found[0].copy()
        learner.collect()
        learner.improve(HandWritten())
        np.testing.assert_array_equal(policy(obs[0].astype(np.float32)), first)
    finally:
        learner.close()


def test_a_policy_of_another_known_task_of_the_same_sizes_is_refused() -> None:
    env = make("HalfCheetah-v5")
    for env_id, refused in (("Walker2d-v5", True), ("HalfCheetah-v5", False), ("MyCheetah-v0", False)):
        weights = {"obs_mean": np.zeros(17), "obs_std": np.ones(17), "log_std": np.zeros(6)}
        weights |= {"action_low": -np.ones(6), "action_high": np.ones(6)}
        weights |= {"layers.0.weight": np.zeros((6, 17)), "layers.0.bias": np.zeros(6)}
        policy = Policy(PolicySpec(env_id, 17, 6, (), "tanh", "gaussian"), weights)
        if refused:
            with pytest.raises(UserError, match="is of Walker2d-v5, which is not HalfCheetah-v5"):
                check_policy(policy, env)
        else:
            check_policy(policy, env)
    env.close()
