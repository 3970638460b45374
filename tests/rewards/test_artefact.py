import json
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors.torch import load_file, save_file

from irl.core import files
from irl.core.errors import UserError
from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import RewardFn, Transitions
from irl.envs.absorbing import absorb
from irl.rewards.artefact import SPEC, WEIGHTS, load_reward, save_reward
from irl.rewards.learned import RewardSpec
from irl.rewards.maps import MAPS, gail
from irl.rewards.nets import LogitNet, LogitSpec

SHAPE = LogitSpec(3, 2, (5, 4))
REWARD = RewardSpec(
    env_id="Hopper-v5",
    method="gail",
    reward_map="gail",
    inputs="obs, action",
    net=SHAPE,
    gamma=0.99,
    reward_scale=2.5,
    env_steps=2048,
    provenance={"dataset": "irl/hopper/expert-v0", "episodes": [3, 1], "seed": 0},
)


def batch(n: int = 20, obs_dim: int = 3, action_dim: int = 2) -> Transitions:
    rng = torch_stream(0, "batch")
    # far from mean 0 and deviation 1: a reward that lost its normaliser is another one
    obs, action = 50 + 9 * torch.randn(n, obs_dim, generator=rng), torch.rand(n, action_dim, generator=rng)
    flags = torch.zeros(n, dtype=torch.bool)
    return Transitions(obs, action, obs, flags, flags)


def a_net(seed: int = 0, spec: LogitSpec = SHAPE) -> LogitNet:
    return LogitNet(spec, fitted_normaliser(batch().obs), torch_stream(seed, "net"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save_reward(tmp_path / "reward", REWARD, a_net())
    return tmp_path / "reward"


def edit(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    content = json.loads((folder / SPEC).read_text())
    change(content)
    (folder / SPEC).write_text(json.dumps(content))


def set_weights(folder: Path, weights: dict[str, torch.Tensor]) -> None:
    """Other weights under a specification that knows their checksum."""
    save_file(weights, folder / WEIGHTS)
    edit(folder, lambda content: content.update(weights_sha256=files.sha256(folder / WEIGHTS)))


@pytest.mark.parametrize("hidden", [(), (6,), (5, 4)])
@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_a_loaded_reward_gives_the_same_rewards_to_the_bit(tmp_path: Path, hidden, activation) -> None:
    shape = LogitSpec(3, 2, hidden, activation)
    spec, net = replace(REWARD, net=shape), a_net(spec=shape)
    save_reward(tmp_path, spec, net)
    reward = load_reward(tmp_path)
    assert reward.spec == spec
    with torch.no_grad():
        assert torch.equal(reward.logits(batch()), net(batch()))
        assert torch.equal(reward(batch()), gail(net(batch())))


def test_it_takes_raw_observations_and_is_frozen(folder: Path) -> None:
    reward: RewardFn = load_reward(folder)
    steps, net = batch(), a_net()
    normalised = (steps.obs - steps.obs.mean(0)) / steps.obs.std(0, unbiased=False)
    by_hand = gail(net.body(torch.cat([normalised, steps.action], 1)).squeeze(1)).detach()
    torch.testing.assert_close(reward(steps), by_hand)
    assert not reward(steps).requires_grad
    assert reward(steps).std() > 0.01


def test_the_specification_is_plain_json(folder: Path) -> None:
    content = json.loads((folder / SPEC).read_text())
    assert (content["format"], content["version"]) == ("irl.reward", 5)
    assert content["net"] == {
        "kind": "logit",
        "obs_dim": 3,
        "action_dim": 2,
        "hidden": [5, 4],
        "activation": "tanh",
        "absorbing_scale": 0.0,
        "spectral_norm": False,
        "sees": "obs_action",
    }
    assert content["provenance"] == REWARD.provenance
    assert content["weights_sha256"] == files.sha256(folder / WEIGHTS)
    assert sorted(path.name for path in folder.iterdir()) == [SPEC, WEIGHTS]


@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_a_reward_of_an_older_version_is_read_as_it_was(folder: Path, version: int) -> None:
    def as_it_was(content: dict[str, Any]) -> None:
        content["version"] = version
        for name in ("kind", "sees", "absorbing_scale", "spectral_norm")[: {1: 4, 2: 2, 3: 0, 4: 0}[version]]:
            del content["net"][name]

    now = load_reward(folder)
    edit(folder, as_it_was)
    before = load_reward(folder)
    assert before.spec == now.spec
    assert torch.equal(before(batch()), now(batch()))


@pytest.mark.parametrize("reward_map", MAPS)
def test_the_map_is_the_specifications(tmp_path: Path, reward_map: str) -> None:
    save_reward(tmp_path, replace(REWARD, reward_map=reward_map), a_net())
    reward = load_reward(tmp_path)
    assert torch.equal(reward(batch()), MAPS[reward_map](reward.logits(batch())))


def test_a_reward_that_knows_the_absorbing_state_comes_back_to_the_bit(tmp_path: Path) -> None:
    shape = LogitSpec(3, 2, (5, 4), "relu", absorbing_scale=10.0, spectral_norm=True)
    net = a_net(spec=shape)
    spec = replace(REWARD, reward_map="logit", net=shape, gamma=0.9)
    save_reward(tmp_path, spec, net)
    reward, raw = load_reward(tmp_path), batch()
    ended = replace(raw, terminated=torch.arange(20) % 7 == 6)
    assert reward.spec == spec
    with torch.no_grad():
        expected = net(raw) + ended.terminated * 9.0 * net.of_absorbing()
    # the tail is the artefact's: 0.9 / (1 - 0.9) = 9
    torch.testing.assert_close(reward(ended), expected)
    # with s_abs put in, nothing is added: its reward is there as rows
    absorbed = absorb(ended)
    assert torch.equal(reward(absorbed)[:20], reward(raw))
    torch.testing.assert_close(reward(absorbed)[20:], net.of_absorbing().detach().expand(2))


def test_a_snapshot_and_a_run_are_places_of_a_reward(tmp_path: Path) -> None:
    for seed, steps in enumerate((0, 900, 20_000)):
        place = tmp_path / "snapshots" / f"{steps:09d}"
        save_reward(place / "reward", replace(REWARD, env_steps=steps), a_net(seed))
    assert load_reward(tmp_path / "snapshots" / "000000900").spec.env_steps == 900
    last = load_reward(str(tmp_path))
    assert last.spec.env_steps == 20_000
    with torch.no_grad():
        assert torch.equal(last.logits(batch()), a_net(2)(batch()))
    # a copy of somebody's, and names of another width
    for name in ("backup", "9000"):
        place = tmp_path / "snapshots" / name / "reward"
        save_reward(place, replace(REWARD, env_steps=7), a_net(3))
    assert load_reward(tmp_path).spec.env_steps == 20_000


@pytest.mark.parametrize("below", [".", "nowhere"])
def test_a_place_without_a_reward_is_refused(tmp_path: Path, below: str) -> None:
    with pytest.raises(UserError, match=r"no reward in .*spec\.json"):
        load_reward(tmp_path / below)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.update(version=6), "expected format irl.reward 1 to 5, found 'irl.reward' 6"),
        (lambda c: c.update(format="irl.policy"), "expected format irl.reward 1 to 5, found 'irl.policy'"),
        (lambda c: c.update(reward_map="airy"), "unknown map 'airy'; known: gail"),
        (lambda c: c.update(extra=1), "spec.json: unknown extra; known: env_id"),
        (lambda c: c.pop("gamma"), "spec.json: missing gamma"),
        (lambda c: c["net"].update(sees="action"), "sees must be one of obs_action, obs"),
        (lambda c: c.pop("version"), "version"),
        (lambda c: c.pop("weights_sha256"), "weights_sha256"),
        (lambda c: c.update(gamma="high"), "spec.json.gamma: expected float"),
        (lambda c: c["net"].update(extra=1), "spec.json.net: unknown extra"),
        (lambda c: c["net"].update(activation="gelu"), "gelu"),
        (lambda c: c["net"].update(absorbing_scale=-1.0), "absorbing_scale must be at least 0"),
        (lambda c: c["net"].update(absorbing_scale=10.0), "size mismatch"),
        (lambda c: c["net"].update(spectral_norm=True), "Missing key"),
        (lambda c: c["net"].pop("spectral_norm"), "spec.json.net: missing spectral_norm"),
        (lambda c: c["net"].update(hidden=[5, 5]), "size mismatch"),
        (lambda c: c["net"].update(obs_dim=4), "size mismatch"),
        (lambda c: c.update(net=[3, 2]), "spec.json.net: kind is one of logit, shaped"),
        (lambda c: c["net"].pop("kind"), "spec.json.net: kind is one of logit, shaped"),
        (lambda c: c["net"].update(kind="shaped"), "spec.json.net: unknown sees, spectral_norm"),
    ],
)
def test_a_specification_that_does_not_fit_is_refused(folder: Path, change, message: str) -> None:
    edit(folder, change)
    with pytest.raises(UserError, match=message) as caught:
        load_reward(folder)
    assert str(folder) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", ["[]", "{", "1"])
def test_a_specification_that_is_none_is_refused(folder: Path, content: str) -> None:
    (folder / SPEC).write_text(content)
    with pytest.raises(UserError, match="reward"):
        load_reward(folder)


def test_weights_that_are_not_the_specifications_are_refused(folder: Path) -> None:
    whole = (folder / WEIGHTS).read_bytes()
    # the last byte belongs to a number: every file of that length is a readable one
    (folder / WEIGHTS).write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(UserError, match="sha256"):
        load_reward(folder)
    for length in (0, 4, 50, len(whole) - 1):
        (folder / WEIGHTS).write_bytes(whole[:length])
        with pytest.raises(UserError, match="not a reward this version reads"):
            load_reward(folder)
    (folder / WEIGHTS).unlink()
    with pytest.raises(UserError, match="not a reward this version reads"):
        load_reward(folder)


def test_weights_of_another_network_are_refused(folder: Path) -> None:
    weights = load_file(folder / WEIGHTS)
    for name in weights:
        set_weights(folder, {other: weights[other] for other in weights if other != name})
        with pytest.raises(UserError, match=r"Missing key|do not fit"):
            load_reward(folder)
    set_weights(folder, weights | {"tail": torch.zeros(1)})
    with pytest.raises(UserError, match="tail"):
        load_reward(folder)
    set_weights(folder, weights)
    load_reward(folder)


class Payload:
    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.mark,)


def test_a_pickle_in_the_weights_place_is_not_run(folder: Path) -> None:
    mark = folder / "ran"
    (folder / WEIGHTS).write_bytes(pickle.dumps(Payload(mark)))
    edit(folder, lambda content: content.update(weights_sha256=files.sha256(folder / WEIGHTS)))
    with pytest.raises(UserError):
        load_reward(folder)
    assert not mark.exists()


@pytest.mark.parametrize(("obs_dim", "action_dim"), [(4, 2), (3, 1)])
def test_a_batch_of_another_task_is_refused_with_both_shapes(folder: Path, obs_dim, action_dim) -> None:
    message = f"Hopper-v5 takes observations of 3 and actions of 2, the batch has {obs_dim} and {action_dim}"
    with pytest.raises(ValueError, match=message):
        load_reward(folder)(batch(5, obs_dim, action_dim))


def test_saving_leaves_the_network_in_training(folder: Path) -> None:
    net = a_net()
    save_reward(folder, REWARD, net)
    assert net.training
    assert all(parameter.requires_grad for parameter in net.parameters())
