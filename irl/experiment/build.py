"""From a config to the objects that it describes."""

import copy

from irl.algorithms.adversarial import Adversarial
from irl.algorithms.forward import Forward
from irl.core.nets import fitted_normaliser
from irl.core.rng import episode_seeds, torch_stream
from irl.core.types import Transitions
from irl.discriminators.gail import GAIL
from irl.experiment.configs import ExpertRun, GAILRun
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.learners.sac import SACConfig, SACLearner
from irl.rewards.mujoco import HandWritten


def adversarial(config: GAILRun, expert: Transitions) -> Adversarial:
    """GAIL with PPO on the demonstrations `expert`."""
    normaliser = fitted_normaliser(expert.obs)
    learner = PPOLearner(
        config.env_id,
        episode_seeds(config.seed, "training", config.learner.n_envs),
        config.learner,
        seed=config.seed,
        total_steps=config.steps,
        # a copy: SB3 moves and saves its own
        normaliser=copy.deepcopy(normaliser),
        device=config.device,
    )
    discriminator = GAIL(
        expert.obs.shape[1],
        expert.action.shape[1],
        config.discriminator,
        normaliser=normaliser,
        init_rng=torch_stream(config.seed, "discriminator weights"),
        rng=torch_stream(config.seed, "discriminator", config.device),
    )
    rng = torch_stream(config.seed, "minibatches", config.device)
    return Adversarial(learner, discriminator, expert.to(config.device), config.schedule, rng)


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
