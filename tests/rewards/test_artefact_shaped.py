"""AIRL's reward as files: g by default, f when asked, and nothing else."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from irl.core.errors import UserError
from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.policies.density import Density
from irl.policies.policy import Policy, PolicySpec, save_policy
from irl.rewards.artefact import WEIGHTS, load_reward, save_reward
from irl.rewards.learned import RewardSpec
from irl.rewards.shaped import ShapedNet, ShapedSpec
from tests.rewards.test_artefact import REWARD, a_net, batch, edit, set_weights

SHAPED = replace(
    REWARD,
    method="airl",
    reward_map="g",
    net=ShapedSpec(3, 2, (5, 4), (6,), "relu", "obs_action", 10.0),
    gamma=0.9,
)


def shaped_net(spec: RewardSpec = SHAPED) -> ShapedNet:
    assert isinstance(spec.net, ShapedSpec)
    return ShapedNet(spec.net, fitted_normaliser(batch().obs), torch_stream(0, "net"))


def steps() -> Transitions:
    return replace(batch(), next_obs=batch().obs.roll(1, 0), terminated=torch.arange(20) % 7 == 6)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save_reward(tmp_path / "reward", SHAPED, shaped_net())
    return tmp_path / "reward"


def test_g_f_and_h_come_back_to_the_bit(folder: Path) -> None:
    g, f, net = load_reward(folder), load_reward(folder, "f"), shaped_net()
    assert g.spec == SHAPED
    assert f.spec == replace(SHAPED, reward_map="f")
    going_on = replace(steps(), terminated=torch.zeros(20, dtype=torch.bool))
    with torch.no_grad():
        assert torch.equal(g(going_on), net.g(going_on))
        assert torch.equal(f(going_on), net.f(going_on, 0.9))
        assert torch.equal(f.logits(going_on), net.f(going_on, 0.9))
        assert isinstance(f.net, ShapedNet)
        assert torch.equal(f.net.h(going_on), net.h(going_on))
        # at an end, with what s_abs pays
        for reward, part in ((g, "g"), (f, "f")):
            assert torch.equal(reward(steps()), net.paid(part, steps(), 0.9))
    assert not torch.allclose(g(steps()), f(steps()))


def test_a_state_only_reward_comes_back_to_the_bit(tmp_path: Path) -> None:
    spec = replace(SHAPED, inputs="obs", net=ShapedSpec(3, 2, (), (4,), inputs="obs"))
    save_reward(tmp_path, spec, net := shaped_net(spec))
    with torch.no_grad():
        assert torch.equal(load_reward(tmp_path)(steps()), net.g(steps()))


def test_a_reward_of_version_3_is_read_as_it_was(folder: Path) -> None:
    def as_it_was(content: dict[str, Any]) -> None:
        content["version"] = 3
        del content["net"]["log_pi_bound"]

    now = load_reward(folder)
    edit(folder, as_it_was)
    assert load_reward(folder).spec == now.spec


def a_policy(distribution: str = "gaussian") -> Policy:
    rng = np.random.default_rng(0)
    weights = {"obs_mean": np.zeros(3), "obs_std": np.full(3, 0.7), "log_std": np.array([-0.5, 0.2])}
    weights |= {"action_low": -np.ones(2), "action_high": np.ones(2)}
    weights |= {"layers.0.weight": rng.normal(size=(2, 3)), "layers.0.bias": rng.normal(size=2)}
    if distribution == "categorical":
        del weights["log_std"]
    return Policy(PolicySpec("Task-v0", 3, 2, (), "tanh", distribution), weights)


def test_f_less_the_log_density_of_the_policy_beside_it(folder: Path) -> None:
    save_policy(policy := a_policy(), folder.parent / "policy.safetensors")
    reward, f, log_pi = load_reward(folder, "f-log-pi"), load_reward(folder, "f"), Density(policy)
    assert reward.spec.reward_map == "f-log-pi"
    edit(folder, lambda c: c["net"].update(log_pi_bound=2.0))
    near = load_reward(folder, "f-log-pi")
    of_policy = log_pi(steps())
    assert of_policy.min() < -2.0
    torch.testing.assert_close(reward(steps()), f(steps()) - of_policy.clamp(-10, 10))
    torch.testing.assert_close(near(steps()), f(steps()) - of_policy.clamp(-2, 2))
    assert torch.equal(near.to("cpu")(steps()), near(steps()))
    resting = replace(steps(), terminated=steps().terminated & False, absorbing=torch.ones(20).bool())
    assert torch.equal(reward(resting), f(resting))


def test_without_its_policy_there_is_no_f_less_log_pi(folder: Path) -> None:
    with pytest.raises(UserError, match=r"policy\.safetensors is not there; choose one of g, f"):
        load_reward(folder, "f-log-pi")
    save_policy(a_policy("categorical"), folder.parent / "policy.safetensors")
    with pytest.raises(UserError, match="has no density"):
        load_reward(folder, "f-log-pi")


@pytest.mark.parametrize("part", ["h", "logit", "", "f - log pi"])
def test_a_part_that_there_is_not_is_refused(folder: Path, part: str) -> None:
    with pytest.raises(UserError, match=r"airl in .* has no part .*; choose one of g, f, f-log-pi") as caught:
        load_reward(folder, part)
    assert "\n" not in str(caught.value)


def test_another_methods_reward_has_no_parts(tmp_path: Path) -> None:
    save_reward(tmp_path, REWARD, a_net())
    with pytest.raises(UserError, match="only AIRL's rewards have; leave it out"):
        load_reward(tmp_path, "g")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.update(reward_map="gail"), "unknown map 'gail'; known: g, f"),
        (lambda c: c.update(version=2), "unknown inputs, log_pi_bound, potential_hidden"),
        (lambda c: c["net"].update(inputs="all"), "spec.json.net.inputs: expected 'obs', 'obs_action'"),
        (lambda c: c["net"].update(inputs="obs"), "size mismatch"),
        (lambda c: c["net"].update(potential_hidden=[7]), "size mismatch"),
        (lambda c: c["net"].update(potential_hidden=[500_000, 500_000]), "do not fit"),
        (lambda c: c["net"].update(obs_dim=-2), "do not fit"),
        (lambda c: c["net"].update(absorbing_scale=0.0), "size mismatch"),
        (lambda c: c["net"].update(activation="gelu"), "gelu"),
        (lambda c: c["net"].update(kind="logit"), "unknown inputs, log_pi_bound, potential_hidden"),
        (lambda c: c["net"].pop("potential_hidden"), "missing potential_hidden"),
    ],
)
def test_a_specification_that_does_not_fit_is_refused(folder: Path, change, message: str) -> None:
    edit(folder, change)
    with pytest.raises(UserError, match=message) as caught:
        load_reward(folder)
    assert "\n" not in str(caught.value)


def test_weights_of_another_network_are_refused(folder: Path) -> None:
    weights = load_file(folder / WEIGHTS)
    for name in weights:
        set_weights(folder, {other: weights[other] for other in weights if other != name})
        with pytest.raises(UserError, match=r"Missing key|do not fit"):
            load_reward(folder)
    name = "potential.0.bias"
    set_weights(folder, weights | {name: torch.full_like(weights[name], float("nan"))})
    with pytest.raises(UserError, match=r"potential\.0\.bias has values that are not finite"):
        load_reward(folder)


@pytest.mark.parametrize("part", ["g", "f", "f-log-pi"])
@pytest.mark.parametrize("ends", [True, False])
def test_anchored_it_pays_an_episode_less_what_the_absorbing_state_pays_for_ever(
    folder: Path, part: str, ends: bool
) -> None:
    save_policy(a_policy(), folder.parent / "policy.safetensors")
    reward = load_reward(folder, part)
    last = torch.arange(20) == 19
    episode = replace(steps(), terminated=last & ends)
    discount = 0.9 ** torch.arange(20)
    given, anchored = reward(episode), reward.anchored(episode)
    rest = replace(episode, absorbing=~last | True, next_absorbing=~last | True, terminated=last & False)[:1]
    of_rest = float(reward(replace(rest, obs=rest.obs * 0, action=rest.action * 0, next_obs=rest.obs * 0))[0])
    # what follows the 20 steps: s_abs for ever where they ended, the same unknown for both where they did not
    less = of_rest / 0.1 if ends else of_rest * float(discount.sum())
    assert float((discount * given).sum() - (discount * anchored).sum()) == pytest.approx(less, rel=1e-4)


def test_anchored_a_reward_without_an_absorbing_state_is_as_it_was(tmp_path: Path) -> None:
    spec = replace(SHAPED, inputs="obs", net=ShapedSpec(3, 2, (), (4,), inputs="obs"))
    save_reward(tmp_path, spec, shaped_net(spec))
    reward = load_reward(tmp_path)
    assert torch.equal(reward.anchored(steps()), reward(steps()))
