"""The update is SB3's: the same weights from the same batches, noise and settings."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from stable_baselines3 import SAC
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from torch import Tensor

from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.learners.sac_update import SACUpdate

B, O, A = 32, 3, 1  # noqa: E741


class Twisted(gym.Env):
    """Only spaces: actions whose bounds have neither middle 0 nor width 2."""

    observation_space = Box(-np.inf, np.inf, (O,), np.float32)
    action_space = Box(-1.0, 4.0, (A,), np.float32)


def model() -> SAC:
    sb3 = SAC("MlpPolicy", Twisted(), policy_kwargs={"net_arch": [16, 8]}, seed=1, batch_size=B)
    sb3.set_logger(Logger(folder=None, output_formats=[]))
    return sb3


def batches(n: int) -> list[tuple[Transitions, Tensor]]:
    rng = torch.Generator().manual_seed(0)
    made = []
    for _ in range(n):
        obs, next_obs = torch.randn(2, B, O, generator=rng)
        action = torch.rand(B, A, generator=rng) * 5 - 1
        terminated, truncated = torch.rand(2, B, generator=rng) < 0.1
        made.append(
            (
                Transitions(obs, action, next_obs, terminated, truncated & ~terminated),
                torch.randn(B, generator=rng),
            )
        )
    return made


def ours(given: list[tuple[Transitions, Tensor]], dtype: torch.dtype = torch.float32) -> SAC:
    sb3 = model()
    update = SACUpdate(sb3, Normaliser(O), None, dtype)
    torch.manual_seed(7)
    for batch, reward in given:
        update(batch, reward, 3e-4)
    return sb3


def theirs(given: list[tuple[Transitions, Tensor]]) -> SAC:
    sb3 = model()
    update = SACUpdate(model(), Normaliser(O), None, torch.float32)
    left = iter(given)

    class Buffer:
        def sample(self, size: int, env: object = None) -> ReplayBufferSamples:
            batch, reward = next(left)
            ended = batch.terminated.float()[:, None]
            return ReplayBufferSamples(
                batch.obs, update.inputs.scaled(batch.action), batch.next_obs, ended, reward[:, None]
            )

    sb3.replay_buffer = Buffer()  # pyright: ignore[reportAttributeAccessIssue]
    torch.manual_seed(7)
    sb3.train(gradient_steps=len(given), batch_size=B)
    return sb3


def test_fifty_updates_give_the_weights_of_sb3() -> None:
    given = batches(50)
    a, b = ours(given), theirs(given)
    assert isinstance(a.log_ent_coef, Tensor)
    assert isinstance(b.log_ent_coef, Tensor)
    torch.testing.assert_close(a.log_ent_coef.detach(), b.log_ent_coef.detach(), rtol=1e-4, atol=1e-5)
    mine, its = a.policy.state_dict(), b.policy.state_dict()
    start = model().policy.state_dict()
    for name, weight in its.items():
        torch.testing.assert_close(mine[name], weight, rtol=1e-3, atol=2e-5)
    assert max(float((its[name] - start[name]).abs().max()) for name in its) > 1e-3


def test_bfloat16_products_follow_float32_ones_without_equalling_them() -> None:
    given = batches(50)
    exact, rounded = ours(given).policy.state_dict(), ours(given, torch.bfloat16).policy.state_dict()
    moved = model().policy.state_dict()
    for name, weight in exact.items():
        if name.endswith("weight"):
            off, way = (rounded[name] - weight).norm(), (weight - moved[name]).norm()
            assert 0.0 < off < 0.3 * way, name


def test_a_time_limit_bootstraps_and_a_termination_does_not() -> None:
    (batch, reward), *_ = batches(1)
    every = torch.ones(B, dtype=torch.bool)
    none = ~every

    def critic_after(terminated: Tensor, truncated: Tensor, future: float) -> Tensor:
        changed = Transitions(
            batch.obs, batch.action, torch.full_like(batch.next_obs, future), terminated, truncated
        )
        return ours([(changed, reward)] * 2).critic.state_dict()["qf0.4.weight"]

    assert torch.equal(critic_after(every, none, 0.0), critic_after(every, none, 3.0))
    assert not torch.equal(critic_after(none, every, 0.0), critic_after(none, every, 3.0))


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16])
def test_the_networks_that_act_are_the_ones_that_were_trained(dtype: torch.dtype) -> None:
    sb3 = ours(batches(3), dtype)
    fresh = model()
    fresh.policy.load_state_dict(sb3.policy.state_dict())
    obs = np.random.default_rng(0).normal(size=(5, O)).astype(np.float32)
    np.testing.assert_array_equal(
        sb3.predict(obs, deterministic=True)[0], fresh.predict(obs, deterministic=True)[0]
    )


def absorbed(batch: Transitions, flags: tuple[bool, bool]) -> Transitions:
    """The batch with every row from and to where the flags say."""
    here, there = (torch.full((B,), flag) for flag in flags)
    never = torch.zeros(B, dtype=torch.bool)
    return Transitions(
        batch.obs.masked_fill(here[:, None], 0.0),
        batch.action.masked_fill(here[:, None], 0.0),
        batch.next_obs.masked_fill(there[:, None], 0.0),
        never,
        never,
        absorbing=here,
        next_absorbing=there,
    )


def wide() -> tuple[SAC, SACUpdate]:
    class Wider(Twisted):
        observation_space = Box(-np.inf, np.inf, (O + 1,), np.float32)

    sb3 = SAC("MlpPolicy", Wider(), policy_kwargs={"net_arch": [16, 8]}, seed=1, batch_size=B)
    return sb3, SACUpdate(sb3, Normaliser(O), torch.Generator().manual_seed(0), torch.float32, 10.0)


def test_in_the_absorbing_state_actor_and_temperature_learn_nothing_and_critics_do() -> None:
    (batch, reward), *_ = batches(1)
    sb3, update = wide()
    actor = {name: weight.clone() for name, weight in sb3.actor.state_dict().items()}
    critic = {name: weight.clone() for name, weight in sb3.critic.state_dict().items()}
    assert isinstance(sb3.log_ent_coef, Tensor)
    temperature = sb3.log_ent_coef.detach().clone()
    update(absorbed(batch, (True, True)), reward, 1e-3)
    assert all(torch.equal(weight, actor[name]) for name, weight in sb3.actor.state_dict().items())
    assert torch.equal(sb3.log_ent_coef.detach(), temperature)
    assert any(not torch.equal(weight, critic[name]) for name, weight in sb3.critic.state_dict().items())


def test_the_target_of_a_step_into_the_absorbing_state_has_no_action_and_no_entropy() -> None:
    """It is r + gamma min Q'(s_abs, 0), whatever the actor would do there."""
    (batch, reward), *_ = batches(1)

    def critics(leads_into_absorbing: bool, actors_bias: float) -> dict[str, Tensor]:
        sb3, update = wide()
        assert isinstance(sb3.actor.mu, torch.nn.Linear)
        with torch.no_grad():
            sb3.actor.mu.bias.add_(actors_bias)
            update.refresh()
        update(absorbed(batch, (False, leads_into_absorbing)), reward, 1e-3)
        return sb3.critic.state_dict()

    into, other = critics(True, 0.0), critics(True, 5.0)
    assert all(torch.equal(into[name], other[name]) for name in into)
    # and with a step that goes on among the living, it is not so
    on, other = critics(False, 0.0), critics(False, 5.0)
    assert any(not torch.equal(on[name], other[name]) for name in on)
