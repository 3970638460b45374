"""`irl.imitate`: ready-made models of SB3 learn from demonstrations, and DAC says why it takes none."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from stable_baselines3 import PPO, TD3
from stable_baselines3.common.vec_env import DummyVecEnv

import irl
from irl.algorithms.adversarial import ScheduleConfig
from irl.algorithms.interleaved import InterleavedConfig
from irl.algorithms.loop import Round
from irl.core.types import Episode, from_episodes
from irl.demos.load import Demos
from irl.discriminators.airl import AIRLConfig
from irl.discriminators.gail import GAILConfig
from irl.rewards.artefact import load_reward, save_reward
from tests import pointmass
from tests.learners.test_ready import a_ppo, a_sac, envs, weights

MAKE = {"PPO": a_ppo, "SAC": a_sac}


@pytest.mark.parametrize("algorithm", MAKE)
@pytest.mark.parametrize("method", ["gail", "airl"])
def test_the_model_is_trained_in_place_and_the_reward_is_an_artefact(
    algorithm: str, method: Any, tmp_path: Path
) -> None:
    model, seen = MAKE[algorithm](envs("Cliff-v0")), list[Round]()
    before = weights(model)
    demos = pointmass.demonstrations(3)
    small: Any = GAILConfig(hidden=(8,)) if method == "gail" else None
    reward = irl.imitate(model, demos, method=method, steps=300, discriminator=small, on_round=seen.append)
    assert seen[-1].env_steps == model.num_timesteps == reward.spec.env_steps >= 300
    after = weights(model)
    assert any(not torch.equal(before[name], after[name]) for name in before)
    assert (reward.spec.env_id, reward.spec.method, reward.spec.gamma) == ("Cliff-v0", method, 0.99)
    steps = from_episodes(demos)
    save_reward(tmp_path, reward.spec, reward.net)
    assert torch.equal(load_reward(tmp_path)(steps), reward(steps))


class InDoubles(gym.Wrapper):
    """Bounds of actions are float64, which `Box` makes of Python's own numbers where it is asked."""

    def __init__(self) -> None:
        super().__init__(gym.make("PointMass-v0"))
        self.action_space = Box(-1.0, 1.0, (2,), np.float64)


@pytest.mark.parametrize("algorithm", MAKE)
@pytest.mark.parametrize("method", ["gail", "airl"])
def test_bounds_of_actions_may_be_doubles(algorithm: str, method: str) -> None:
    model = MAKE[algorithm](DummyVecEnv([InDoubles]))
    reward = irl.imitate(model, pointmass.demonstrations(1), method=method, steps=100)
    assert reward(from_episodes(pointmass.demonstrations(1))).dtype == torch.float32


@pytest.mark.parametrize("algorithm", MAKE)
def test_the_model_can_learn_on_and_imitate_again(algorithm: str) -> None:
    model, small = MAKE[algorithm](own := envs("PointMass-v0")), GAILConfig(hidden=(8,))
    memory, demos = getattr(model, "replay_buffer", None), pointmass.demonstrations(2)
    for _ in range(2):
        irl.imitate(model, demos, steps=200, discriminator=small)
        assert model.get_env() is own
        assert getattr(model, "replay_buffer", None) is memory
    wrong: Any = InterleavedConfig() if algorithm == "PPO" else ScheduleConfig()
    with pytest.raises(ValueError, match="schedule is a"):
        irl.imitate(model, demos, steps=200, discriminator=small, schedule=wrong)
    assert model.get_env() is own
    model.learn(100, reset_num_timesteps=False)
    paid = model.rollout_buffer.rewards if algorithm == "PPO" else memory.rewards[: memory.pos]  # pyright: ignore
    # the task's own reward, which is never 0 away from the origin
    assert (paid < 0).all()


def test_gail_teaches_a_ready_made_ppo_the_task() -> None:
    model = PPO(
        "MlpPolicy",
        envs(n=8),
        n_steps=64,
        batch_size=128,
        learning_rate=1e-3,
        gamma=0.9,
        policy_kwargs={"net_arch": [32]},
        seed=0,
    )

    def mean_return() -> float:
        env = gym.make("PointMass-v0")
        returns = []
        for seed in range(10):
            obs, _ = env.reset(seed=seed)
            total, over = 0.0, False
            while not over:
                obs, reward, terminated, truncated, _ = env.step(model.predict(obs, deterministic=True)[0])
                total, over = total + float(reward), terminated or truncated
            returns.append(total)
        return float(np.mean(returns))

    expert = np.mean([episode.return_ for episode in pointmass.demonstrations(5)])
    untrained = mean_return()
    irl.imitate(model, pointmass.demonstrations(5), steps=15_000)
    assert (mean_return() - untrained) / (expert - untrained) > 0.8


def test_demonstrations_that_no_policy_could_give_are_refused() -> None:
    (episode,) = pointmass.demonstrations(1)
    far = replace(episode, action=episode.action * 5)
    with pytest.raises(ValueError, match=r"episode 1 .* has the action .* the model takes -1 to 1"):
        irl.imitate(a_ppo(), [episode, far], steps=100)


def test_demonstrations_of_another_known_task_of_the_same_shapes_are_refused() -> None:
    still = Episode(np.zeros((3, 17)), np.zeros((2, 6)), np.zeros(2), terminated=False, truncated=True)
    demos = Demos((still,), (), (0,), (), "x-v0", "Walker2d-v5", Path(), None, None)
    model = PPO("MlpPolicy", "HalfCheetah-v5", n_steps=64, batch_size=32, device="cpu")
    with pytest.raises(
        ValueError, match="demonstrations are of Walker2d-v5, the model learns HalfCheetah-v5"
    ):
        irl.imitate(model, demos, steps=100)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"method": "dac"}, "indicator of the absorbing state.*use: irl train dac"),
        ({"steps": 0}, "steps must be at least 1, not 0"),
        ({"steps": -5}, "steps must be at least 1, not -5"),
        ({"method": "bc"}, "unknown method 'bc'; expected 'gail' or 'airl'"),
        ({"method": "airl", "discriminator": GAILConfig()}, "GAILConfig are no settings of airl"),
        ({"model": lambda: TD3("MlpPolicy", envs(n=1)), "method": "airl"}, "TD3's policy has one action for"),
        (
            {"model": lambda: a_sac(use_sde=True), "method": "airl"},
            "a SAC of Gaussian actions, without use_s",
        ),
        (
            {"model": lambda: a_ppo(use_sde=True), "method": "airl"},
            "a PPO of Gaussian actions, without use_s",
        ),
        ({"schedule": InterleavedConfig()}, "PPO's schedule is a ScheduleConfig"),
        ({"model": a_sac, "schedule": ScheduleConfig()}, "SAC's schedule is an InterleavedConfig"),
        ({"model": lambda: a_ppo(ent_coef=0.1), "method": "airl"}, "entropy would be paid twice"),
        ({"model": a_sac, "method": "airl", "discriminator": AIRLConfig()}, "entropy would be paid twice"),
        ({"model": lambda: a_sac(envs("Pendulum-v1", 1))}, r"observations of \(2,\) and actions of \(2,\)"),
    ],
)
def test_what_does_not_go_together_is_refused(change: dict[str, Any], message: str) -> None:
    words: dict[str, Any] = {"model": a_ppo, "steps": 100} | change
    model = words.pop("model")()
    with pytest.raises(ValueError, match=message):
        irl.imitate(model, pointmass.demonstrations(1), **words)
    assert model.num_timesteps == 0
