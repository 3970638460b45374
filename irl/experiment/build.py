"""From a config to the objects that it describes."""

import copy
from collections.abc import Sequence

from irl.algorithms.adversarial import Adversarial
from irl.algorithms.forward import Forward
from irl.algorithms.interleaved import Interleaved
from irl.core.nets import fitted_normaliser
from irl.core.rng import episode_seeds, stream, torch_stream
from irl.core.types import Episode, Transitions
from irl.discriminators.dac import DAC
from irl.discriminators.gail import GAIL
from irl.envs.absorbing import subsample
from irl.experiment.configs import DACRun, ExpertRun, GAILRun, Imitation
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.rewards.mujoco import HandWritten


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
    run = {"seed": config.seed, "total_steps": config.steps, "device": config.device}
    match config.learner:
        case PPOConfig() as settings:
            seeds = episode_seeds(config.seed, "training", settings.n_envs)
            learner = PPOLearner(config.env_id, seeds, settings, **run)
        case SACConfig() as settings:
            seeds = episode_seeds(config.seed, "training", settings.n_envs)
            learner = SACLearner(config.env_id, seeds, settings, **run)
    return Forward(learner, HandWritten())
