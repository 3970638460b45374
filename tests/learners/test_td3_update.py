"""The update is SB3's TD3: the same weights from the same batches, noise and settings."""

from typing import Any

import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from stable_baselines3 import TD3
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from torch import Tensor

from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.learners.td3_update import TD3Update
from tests.learners.test_sac_update import B, O, Twisted, absorbed, batches

LR = 1e-3


def model(env: Twisted | None = None, **more: Any) -> TD3:
    settings = {"policy_kwargs": {"net_arch": [16, 8]}, "seed": 1, "batch_size": B, "learning_rate": LR}
    sb3 = TD3("MlpPolicy", env or Twisted(), **settings, **more)  # pyright: ignore[reportArgumentType]
    sb3.set_logger(Logger(folder=None, output_formats=[]))
    return sb3


def ours(given: list[tuple[Transitions, Tensor]], dtype: torch.dtype = torch.float32, **more: Any) -> TD3:
    sb3 = model(**more)
    update = TD3Update(sb3, Normaliser(O), None, dtype)
    torch.manual_seed(7)
    for batch, reward in given:
        update(batch, reward, LR)
    return sb3


def theirs(given: list[tuple[Transitions, Tensor]], **more: Any) -> TD3:
    sb3, inputs = model(**more), TD3Update(model(), Normaliser(O), None, torch.float32).inputs
    left = iter(given)

    class Buffer:
        def sample(self, size: int, env: object = None) -> ReplayBufferSamples:
            batch, reward = next(left)
            ended = batch.terminated.float()[:, None]
            return ReplayBufferSamples(
                batch.obs, inputs.scaled(batch.action), batch.next_obs, ended, reward[:, None]
            )

    sb3.replay_buffer = Buffer()  # pyright: ignore[reportAttributeAccessIssue]
    torch.manual_seed(7)
    sb3.train(gradient_steps=len(given), batch_size=B)
    return sb3


@pytest.mark.parametrize("more", [{}, {"policy_delay": 3, "target_policy_noise": 0.7}])
def test_fifty_updates_give_the_weights_of_sb3(more: dict[str, Any]) -> None:
    given = batches(50)
    mine, its = ours(given, **more).policy.state_dict(), theirs(given, **more).policy.state_dict()
    start = model().policy.state_dict()
    for name, weight in its.items():
        torch.testing.assert_close(mine[name], weight, rtol=1e-3, atol=2e-5)
        if name.endswith("weight"):
            assert float((weight - start[name]).abs().max()) > 1e-4, name


def test_a_time_limit_bootstraps_and_a_termination_does_not() -> None:
    (batch, reward), *_ = batches(1)
    every = torch.ones(B, dtype=torch.bool)

    def critic_after(terminated: Tensor, future: float) -> Tensor:
        after = torch.full_like(batch.next_obs, future)
        changed = Transitions(batch.obs, batch.action, after, terminated, ~terminated)
        return ours([(changed, reward)] * 2).critic.state_dict()["qf0.4.weight"]

    assert torch.equal(critic_after(every, 0.0), critic_after(every, 3.0))
    assert not torch.equal(critic_after(~every, 0.0), critic_after(~every, 3.0))


def test_actor_and_targets_move_at_every_second_update_only() -> None:
    sb3, moved = model(), []
    update = TD3Update(sb3, Normaliser(O), torch.Generator().manual_seed(0), torch.float32)
    for batch, reward in batches(4):
        before = {name: weight.clone() for name, weight in sb3.policy.state_dict().items()}
        update(batch, reward, LR)
        after = sb3.policy.state_dict()
        moved.append({name.split(".")[0] for name in after if not torch.equal(before[name], after[name])})
    assert moved == [{"critic"}, {"critic", "critic_target", "actor", "actor_target"}] * 2


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_the_networks_that_act_are_the_ones_that_were_trained(dtype: torch.dtype) -> None:
    sb3, fresh = ours(batches(4), dtype), model()
    fresh.policy.load_state_dict(sb3.policy.state_dict())
    obs = np.random.default_rng(0).normal(size=(5, O)).astype(np.float32)
    np.testing.assert_array_equal(sb3.predict(obs)[0], fresh.predict(obs)[0])


def wide() -> tuple[TD3, TD3Update]:
    class Wider(Twisted):
        observation_space = Box(-np.inf, np.inf, (O + 1,), np.float32)

    sb3 = model(Wider(), policy_delay=1)
    return sb3, TD3Update(sb3, Normaliser(O), torch.Generator().manual_seed(0), torch.float32, 10.0)


def test_in_the_absorbing_state_the_actor_learns_nothing_and_critics_do() -> None:
    (batch, reward), *_ = batches(1)
    sb3, update = wide()
    before = {name: weight.clone() for name, weight in sb3.policy.state_dict().items()}
    update(absorbed(batch, (True, True)), reward, LR)
    moved = {
        name for name, weight in sb3.policy.state_dict().items() if not torch.equal(weight, before[name])
    }
    assert {name.split(".")[0] for name in moved} == {"critic", "critic_target"}


def test_the_target_of_a_step_into_the_absorbing_state_has_no_action() -> None:
    """It is r + gamma min Q'(s_abs, 0), whatever the actor would do there."""
    (batch, reward), *_ = batches(1)

    def critics(flags: tuple[bool, bool], actors_bias: float) -> dict[str, Tensor]:
        sb3, update = wide()
        with torch.no_grad():
            sb3.actor_target.mu[-2].bias.add_(actors_bias)  # pyright: ignore
            update.refresh()
        update(absorbed(batch, flags), reward, LR)
        return sb3.critic.state_dict()

    into, other = critics((False, True), 0.0), critics((False, True), 0.5)
    assert all(torch.equal(into[name], other[name]) for name in into)
    # and with a step that goes on among the living, it is not so
    on, other = critics((False, False), 0.0), critics((False, False), 0.5)
    assert any(not torch.equal(on[name], other[name]) for name in on)
