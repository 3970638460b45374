"""From a config to the objects that it describes."""

import copy
from collections.abc import Sequence

import gymnasium as gym
import torch
from gymnasium.spaces import Box

from irl.algorithms.adversarial import Adversarial
from irl.algorithms.bc import BC, Cloning
from irl.algorithms.forward import Forward
from irl.algorithms.interleaved import Interleaved
from irl.core.errors import UserError
from irl.core.finite import check_finite, named
from irl.core.nets import Normaliser, fitted_normaliser, mixed_normaliser
from irl.core.rng import episode_seeds, stream, torch_stream
from irl.core.types import Episode, RewardFn, Transitions, from_episodes
from irl.discriminators.airl import AIRL, AIRLConfig
from irl.discriminators.dac import DAC, DACConfig
from irl.discriminators.ensemble import Ensemble, one_or_several
from irl.discriminators.gail import GAIL, GAILConfig
from irl.envs.absorbing import subsample
from irl.envs.discrete import OneHot
from irl.envs.make import make as make_env
from irl.envs.rollouts import random_act, rollouts
from irl.experiment.configs import (
    BCRun,
    ExpertRun,
    FromDemonstrations,
    Imitation,
    OffPolicyRun,
    RetrainRun,
)
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.learners.td3 import TD3Config, TD3Learner
from irl.policies.policy import PolicySpec
from irl.policies.trainable import drawing, fresh_policy
from irl.rewards.ensemble import EnsembleSpec
from irl.rewards.entropic import BOUND, Entropic
from irl.rewards.learned import LearnedReward
from irl.rewards.mujoco import HandWritten
from irl.rewards.shaped import ShapedSpec

RANDOM_EPISODES = 20
"""Of random actions, where observations are normalised by them too."""
AnyLearner = PPOLearner | SACLearner | TD3Learner


def check_device(device: str) -> None:
    """Refuse a device that is not there.

    Raises:
        UserError: it is a GPU, and torch sees none.
    """
    if device == "cuda" and not torch.cuda.is_available():
        raise UserError(
            "--device cuda, but torch sees no GPU here; leave it out to train on the CPU. To repeat a run of "
            "a GPU on the CPU: irl train --config CONFIG --out FOLDER, with device cpu in CONFIG"
        )


def absorbing_scale(config: FromDemonstrations) -> float:
    """Distance of the absorbing state that the discriminator knows; 0 where it knows none."""
    if isinstance(config, BCRun):
        return 0.0
    of = config.discriminator
    return of.scale if isinstance(of, AIRLConfig) else of.absorbing_scale


def check_learner(kind: str, env: gym.Env) -> None:
    """Refuse a learner for a task whose actions it cannot take.

    Raises:
        UserError: it is SAC or TD3, and the task has a choice of actions.
    """
    if kind in (SACConfig.KIND, TD3Config.KIND) and isinstance(env.action_space, OneHot):
        wanted = env.spec.id if env.spec is not None else type(env.unwrapped).__name__
        raise UserError(
            f"{kind.upper()} takes actions that are real numbers, {wanted} has a choice of "
            f"{env.action_space.shape[0]}; learn with PPO: irl train gail, or --algo ppo"
        )


def check_discriminator(of: GAILConfig | AIRLConfig, env: gym.Env) -> None:
    """Refuse a discriminator for a task whose actions it cannot judge.

    Raises:
        UserError: it is AIRL's, and the task has a choice of actions.
    """
    if isinstance(of, AIRLConfig) and isinstance(env.action_space, OneHot):
        wanted = env.spec.id if env.spec is not None else type(env.unwrapped).__name__
        raise UserError(
            f"AIRL takes the density of actions that are real numbers off, {wanted} has a choice of "
            f"{env.action_space.shape[0]}; learn with: irl train gail"
        )


def demonstrations(config: FromDemonstrations, episodes: Sequence[Episode]) -> Transitions:
    """The steps to learn from: thinned and led into the absorbing state where the settings say so."""
    rng = stream(config.seed, "demonstration steps")
    return subsample(episodes, config.demo_rate, rng, absorbing=absorbing_scale(config) > 0)


def imitation(config: Imitation, episodes: Sequence[Episode]) -> Adversarial | Interleaved:
    """A discriminator and a learner on these demonstrations."""
    expert = demonstrations(config, episodes)
    normaliser = _normaliser(config, expert)
    scale = absorbing_scale(config)
    # a copy for each side: both move their own to their device
    learner = _learner(config, copy.deepcopy(normaliser), scale)
    _warm_start(config, learner, expert)
    discriminator = _discriminator(config, expert, normaliser, learner)
    rng = torch_stream(config.seed, "minibatches", config.device)
    expert = expert.to(config.device)
    if isinstance(config, OffPolicyRun):
        return Interleaved(learner, discriminator, expert, config.schedule, rng)
    return Adversarial(learner, discriminator, expert, config.schedule, rng, absorbing=scale > 0)


def _normaliser(config: Imitation, expert: Transitions) -> Normaliser:
    """Of the demonstrations, or of these and as many steps of random actions as a few episodes have."""
    fitted = fitted_normaliser(expert.obs if expert.absorbing is None else expert.obs[~expert.absorbing])
    if config.normaliser == "expert":
        return fitted
    act = random_act(_actions(config.env_id), stream(config.seed, "random actions"))
    played = rollouts(config.env_id, act, episode_seeds(config.seed, "random actions", RANDOM_EPISODES))
    return mixed_normaliser(fitted, fitted_normaliser(from_episodes(played).obs))


def cloning(config: BCRun, episodes: Sequence[Episode], held_out: Sequence[Episode]) -> BC:
    """A policy of random weights to be fitted to these demonstrations."""
    expert, c = demonstrations(config, episodes), config.learner
    box = _actions(config.env_id)
    kind = "categorical" if isinstance(box, OneHot) else c.policy
    spec = PolicySpec(config.env_id, expert.obs.shape[1], len(box.low), c.hidden, c.activation, kind)
    weights = torch_stream(config.seed, "policy weights")
    policy = fresh_policy(spec, fitted_normaliser(expert.obs), (box.low, box.high), -0.5, weights)
    fit = Cloning(policy, expert, c, torch_stream(config.seed, "cloning", config.device))
    return BC(fit, from_episodes(held_out) if held_out else None, c.steps_per_round)


def _warm_start(config: Imitation, learner: AnyLearner, expert: Transitions) -> None:
    """Clone the learner's policy from where it is, before anything is played."""
    if config.warm_start.updates == 0:
        return
    rng = torch_stream(config.seed, "cloning", config.device)
    fit = Cloning(drawing(learner.policy()), expert, config.warm_start, rng)
    for _ in range(config.warm_start.updates):
        fit.update()
    check_finite(named("cloned policy", fit.net.state_dict()))
    learner.adopt(fit.net.export())


def _discriminator(
    config: Imitation, expert: Transitions, normaliser: Normaliser, learner: AnyLearner
) -> GAIL | AIRL | Ensemble:
    sizes = expert.obs.shape[1], expert.action.shape[1] or len(_actions(config.env_id).low)
    settings = config.discriminator

    def make(called: str) -> GAIL | AIRL:
        shared = {
            "normaliser": copy.deepcopy(normaliser),
            "init_rng": torch_stream(config.seed, f"discriminator weights{called}"),
            "rng": torch_stream(config.seed, f"discriminator{called}", config.device),
            "gamma": config.learner.gamma,
        }
        if isinstance(settings, AIRLConfig):
            return AIRL(*sizes, settings, log_pi=learner.log_pi, **shared)
        return (DAC if isinstance(settings, DACConfig) else GAIL)(*sizes, settings, **shared)

    return one_or_several(settings, make)


def _actions(env_id: str) -> Box:
    env = make_env(env_id)
    env.close()
    # `make` admits flat boxes only
    assert isinstance(env.action_space, Box)
    return env.action_space


def forward(config: ExpertRun) -> Forward:
    """PPO, with observations normalised as they come, or SAC on the task's own reward."""
    return Forward(_learner(config), HandWritten())


def on_frozen(config: RetrainRun, reward: LearnedReward) -> Forward:
    """PPO, SAC or TD3 on a learned reward, with a copy of its normaliser, which stays as it is.

    Terminations lead into the absorbing state if the reward knows one: memories have it, and PPO is paid for
    each step above what s_abs pays a step, which no discount of PPO's turns into another task
    (`LearnedReward.anchored`). Where the hand-written reward is asked for, it alone is paid, and nothing
    after a termination.
    """
    net = reward.spec.net
    scale = 0.0 if config.hand_written else net.absorbing_scale
    learner = _learner(config, copy.deepcopy(reward.net.normaliser), scale)
    there = reward.to(config.device)
    paid: RewardFn = there.anchored if isinstance(learner, PPOLearner) else there
    if config.hand_written:
        paid = HandWritten()
    if isinstance(learner, PPOLearner) and config.entropy:
        one = net.of if isinstance(net, EnsembleSpec) else net
        bound = one.log_pi_bound if isinstance(one, ShapedSpec) else BOUND
        paid = Entropic(paid, learner.log_pi, config.entropy, bound)
    return Forward(learner, paid)


def _learner(
    config: Imitation | ExpertRun | RetrainRun, normaliser: Normaliser | None = None, scale: float = 0.0
) -> AnyLearner:
    seeds = episode_seeds(config.seed, "training", config.learner.n_envs)
    run = {"seed": config.seed, "total_steps": config.steps, "device": config.device}
    run["normaliser"] = normaliser
    match config.learner:
        case PPOConfig() as settings:
            return PPOLearner(config.env_id, seeds, settings, **run)
        case SACConfig() as settings:
            return SACLearner(config.env_id, seeds, settings, absorbing_scale=scale, **run)
        case TD3Config() as settings:
            return TD3Learner(config.env_id, seeds, settings, absorbing_scale=scale, **run)
