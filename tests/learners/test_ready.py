"""SB3 models that somebody made: trained on the reward they are given, as SB3 would on one of the task's."""

import io
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize
from torch import Tensor

from irl.core.finite import NotFinite
from irl.core.types import Transitions
from irl.envs.absorbing import absorb
from irl.learners.ready import ready
from tests import pointmass


def position(batch: Transitions) -> Tensor:
    return -batch.next_obs.norm(dim=1)


def nan(batch: Transitions) -> Tensor:
    return torch.full((len(batch),), torch.nan)


def envs(env_id: str = "PointMass-v0", n: int = 2, **kwargs: Any) -> DummyVecEnv:
    return DummyVecEnv([lambda: gym.make(env_id, **kwargs) for _ in range(n)])


def a_ppo(venv: Any = None, **more: Any) -> PPO:
    settings: dict[str, Any] = {
        "n_steps": 64,
        "batch_size": 32,
        "n_epochs": 2,
        "policy_kwargs": {"net_arch": [8]},
        "seed": 0,
    }
    return PPO("MlpPolicy", venv or VecMonitor(envs()), **settings | more)


def a_sac(venv: Any = None, **more: Any) -> SAC:
    settings: dict[str, Any] = {"learning_starts": 20, "batch_size": 16, "buffer_size": 500, "seed": 0}
    return SAC("MlpPolicy", venv or envs(n=1), policy_kwargs={"net_arch": [8]}, **settings | more)


def weights(model: PPO | SAC) -> dict[str, Tensor]:
    return {name: value.clone() for name, value in model.policy.state_dict().items()}


def close(a: dict[str, Tensor], b: dict[str, Tensor]) -> bool:
    return all(torch.allclose(a[name], b[name], atol=1e-6) for name in a)


class Pays(gym.RewardWrapper):
    """The point mass, paying what `position` says; float32, as observations reach a `RewardFn`."""

    def step(self, action: np.ndarray) -> Any:
        obs, _, terminated, truncated, info = self.env.step(action)
        return obs, -float(np.linalg.norm(obs.astype(np.float32))), terminated, truncated, info

    def reward(self, reward: Any) -> Any:
        return reward


def paid(env_id: str, n: int) -> DummyVecEnv:
    return DummyVecEnv([lambda: Pays(gym.make(env_id)) for _ in range(n)])


@pytest.mark.parametrize("env_id", ["PointMass-v0", "Cliff-v0"])
def test_sac_learns_what_sb3_learns_where_the_environment_pays_that_reward(env_id: str) -> None:
    theirs = a_sac(paid(env_id, 1)).learn(100)
    learner = ready(ours := a_sac(envs("NaNReward-v0" if env_id == "PointMass-v0" else env_id, 1)), 100)
    learner.start(position)
    learner._per_round = 100  # pyright: ignore[reportAttributeAccessIssue]
    learner.collect()
    assert learner.env_steps == theirs.num_timesteps == 100
    assert close(weights(ours), weights(theirs))
    assert not close(weights(ours), weights(a_sac()))


def test_ppo_learns_what_sb3_learns_but_for_the_scale_of_the_reward(monkeypatch: pytest.MonkeyPatch) -> None:
    theirs = a_ppo(paid("PointMass-v0", 2)).learn(256)
    learner = ready(ours := a_ppo(envs("NaNReward-v0")), 256)
    monkeypatch.setattr(type(learner._scale), "std", 1.0)  # pyright: ignore[reportAttributeAccessIssue]
    for _ in range(2):
        learner.collect()
        learner.improve(position)
    assert close(weights(ours), weights(theirs))


def kept_in(seen: list[Transitions]) -> Callable[[Transitions], Transitions]:
    def keep(batch: Transitions) -> Transitions:
        seen.append(batch)
        return batch

    return keep


def test_sacs_batches_are_of_the_environments_units_and_ends() -> None:
    seen: list[Transitions] = []
    learner = ready(a_sac(envs("Pendulum-v1", 1, max_episode_steps=30)), 90, absorbing=True)
    learner._per_round = 90  # pyright: ignore[reportAttributeAccessIssue]
    learner.start(lambda batch: torch.zeros(len(batch)), kept_in(seen))
    taken = learner.collect()
    stored = {tuple(row) for row in taken.action.tolist()}
    assert max(abs(a) for (a,) in stored) > 1.0
    for batch in seen:
        assert not batch.terminated.any()  # a time limit is no termination
        found = min(abs(a - b) for (a,) in stored for (b,) in batch.action.tolist()[:1])
        assert found < 1e-6


def test_the_discriminator_sees_the_absorbing_state_and_the_networks_do_not() -> None:
    seen: list[Transitions] = []
    learner = ready(a_sac(envs("Cliff-v0", 1), learning_starts=150), 400, absorbing=True)
    learner._per_round = 400  # pyright: ignore[reportAttributeAccessIssue]
    learner.start(position, kept_in(seen))
    taken = learner.collect()
    assert taken.terminated.any()
    absorbing = [batch for batch in seen if batch.absorbing is not None and batch.absorbing.any()]
    assert absorbing
    for batch in absorbing:
        assert batch.next_absorbing is not None
        assert batch.absorbing is not None
        assert batch.next_absorbing.sum() == 2 * batch.absorbing.sum()
    assert len(absorb(taken)) > len(taken)


@pytest.mark.parametrize("make", [a_ppo, a_sac])
def test_a_reward_that_is_no_number_stops_it(make: Any) -> None:
    learner = ready(make(), 100)
    learner.start(nan)

    def play() -> None:
        learner.collect()
        learner.improve(nan)

    with pytest.raises(NotFinite, match="reward"):
        play()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: A2C("MlpPolicy", envs()), "expected a PPO or SAC of stable_baselines3, not A2C"),
        (lambda: a_ppo(VecNormalize(envs())), "VecNormalize"),
        (lambda: PPO("MlpPolicy", "CartPole-v1"), "actions must be a flat Box, not Discrete"),
        (lambda: a_sac(optimize_memory_usage=True, replay_buffer_kwargs=NO_TIMEOUTS), "plain ReplayBuffer"),
        (lambda: PPO.load(saved()), "no environment"),
    ],
)
def test_a_model_that_a_reward_cannot_be_learned_beside_is_refused(make: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ready(make(), 100)


NO_TIMEOUTS = {"handle_timeout_termination": False}


def saved() -> Any:
    file = io.BytesIO()
    a_ppo().save(file)
    file.seek(0)
    return file


def test_gsde_has_no_density_that_airl_could_take_off() -> None:
    learner = ready(a_ppo(use_sde=True), 256)
    batch = learner.collect()
    with pytest.raises(ValueError, match="without use_sde"):
        learner.log_pi(batch)


def test_what_only_irls_own_learners_have_is_said_to_be_missing() -> None:
    learner = ready(a_ppo(), 128)
    for ask in (learner.policy, learner.state_dict):
        with pytest.raises(NotImplementedError, match=r"model\.save"):
            ask()
    assert learner.take_finished() == []
    learner.collect()
    assert len(learner.take_finished()) == 128 // pointmass.STEPS // 2 * 2


def test_a_recurrent_model_is_refused_with_the_reason_and_what_to_use() -> None:
    small: dict[str, Any] = {"n_steps": 8, "batch_size": 8, "policy_kwargs": {"lstm_hidden_size": 4}}
    model = RecurrentPPO("MlpLstmPolicy", gym.make("PointMass-v0"), **small)
    with pytest.raises(ValueError, match=r"RecurrentPPO remembers what it saw.*MlpPolicy.*FrameStack"):
        ready(model, 100)
