"""From a config to the objects that it describes."""

import copy
from collections.abc import Sequence

import torch

from irl.algorithms.adversarial import Adversarial
from irl.algorithms.forward import Forward
from irl.algorithms.interleaved import Interleaved
from irl.core.errors import UserError
from irl.core.nets import Normaliser, fitted_normaliser
from irl.core.rng import episode_seeds, stream, torch_stream
from irl.core.types import Episode, Transitions
from irl.discriminators.dac import DAC
from irl.discriminators.gail import GAIL
from irl.envs.absorbing import subsample
from irl.experiment.configs import DACRun, ExpertRun, GAILRun, Imitation, RetrainRun
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.rewards.artefact import LearnedReward
from irl.rewards.mujoco import HandWritten


def check_device(device: str) -> None:
    """Refuse a device that is not there.

    Raises:
        UserError: it is a GPU, and torch sees none.
    """
    if device == "cuda" and not torch.cuda.is_available():
        raise UserError("--device cuda, but torch sees no GPU here; leave it out to train on the CPU")


def demonstrations(config: Imitation, episodes: Sequence[Episode]) -> Transitions:
    """The steps to learn from: thinned and led into the absorbing state where the settings say so."""
    rng = stream(config.seed, "demonstration steps")
    absorbing = config.discriminator.absorbing_scale > 0
    return subsample(episodes, config.demo_rate, rng, absorbing=absorbing)


def imitation(config: Imitation, episodes: Sequence[Episode]) -> Adversarial | Interleaved:
    """A discriminator and a learner on these demonstrations."""
    expert = demonstrations(config, episodes)
    real = expert.obs if expert.absorbing is None else expert.obs[~expert.absorbing]
    normaliser = fitted_normaliser(real)
    make = DAC if isinstance(config, DACRun) else GAIL
    discriminator = make(
        expert.obs.shape[1],
        expert.action.shape[1],
        config.discriminator,
        # copies: each side moves its own to its device
        normaliser=copy.deepcopy(normaliser),
        init_rng=torch_stream(config.seed, "discriminator weights"),
        rng=torch_stream(config.seed, "discriminator", config.device),
        gamma=config.learner.gamma,
    )
    rng = torch_stream(config.seed, "minibatches", config.device)
    seeds = episode_seeds(config.seed, "training", config.learner.n_envs)
    run = {"seed": config.seed, "total_steps": config.steps, "device": config.device}
    run["normaliser"] = normaliser
    expert = expert.to(config.device)
    if isinstance(config, GAILRun):
        on_policy = PPOLearner(config.env_id, seeds, config.learner, **run)
        return Adversarial(on_policy, discriminator, expert, config.schedule, rng)
    scale = config.discriminator.absorbing_scale
    off_policy = SACLearner(config.env_id, seeds, config.learner, absorbing_scale=scale, **run)
    return Interleaved(off_policy, discriminator, expert, config.schedule, rng)


def forward(config: ExpertRun) -> Forward:
    """PPO, with observations normalised as they come, or SAC on the task's own reward."""
    return Forward(_learner(config), HandWritten())


def on_frozen(config: RetrainRun, reward: LearnedReward) -> Forward:
    """PPO or SAC on a learned reward, with a copy of its normaliser, which stays as it is.

    Terminations lead into the absorbing state if the reward knows one: SAC puts it into its memory, for PPO
    the reward adds what it pays.
    """
    net = copy.deepcopy(reward.net).to(config.device)
    learner = _learner(config, copy.deepcopy(reward.net.normaliser), net.spec.absorbing_scale)
    return Forward(learner, LearnedReward(reward.spec, net))


def _learner(
    config: ExpertRun | RetrainRun, normaliser: Normaliser | None = None, absorbing_scale: float = 0.0
) -> PPOLearner | SACLearner:
    seeds = episode_seeds(config.seed, "training", config.learner.n_envs)
    run = {"seed": config.seed, "total_steps": config.steps, "device": config.device}
    run["normaliser"] = normaliser
    match config.learner:
        case PPOConfig() as settings:
            return PPOLearner(config.env_id, seeds, settings, **run)
        case SACConfig() as settings:
            return SACLearner(config.env_id, seeds, settings, absorbing_scale=absorbing_scale, **run)
