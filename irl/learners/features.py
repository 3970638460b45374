"""The observation normaliser as SB3's feature extractor, so that it travels with the policy."""

import gymnasium as gym
import numpy as np
import torch
from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv
from torch import Tensor

from irl.core.nets import CLIP, Normaliser


class NormalisedFeatures(BaseFeaturesExtractor):
    """Features of an observation: the observation, normalised."""

    def __init__(
        self, observation_space: Box, normaliser: Normaliser | None = None, clip: float = CLIP
    ) -> None:
        """`normaliser` is used as it is; without one, a fresh one is, with this bound."""
        super().__init__(observation_space, features_dim=observation_space.shape[0])
        self.normaliser = normaliser or Normaliser(observation_space.shape[0], clip)

    def forward(self, obs: Float[Tensor, "B O"]) -> Float[Tensor, "B O"]:
        """Normalised observations."""
        return self.normaliser(obs)


class Spaces(gym.Env):
    """Only what SB3 needs to know to build networks: the spaces of an environment."""

    def __init__(self, venv: VecEnv, one_more: bool) -> None:
        """`one_more` adds a number to the observations: the indicator of the absorbing state."""
        assert venv.observation_space.shape is not None
        size = venv.observation_space.shape[0] + one_more
        self.observation_space = Box(-np.inf, np.inf, (size,), np.float32)
        self.action_space = venv.action_space


def widened(normaliser: Normaliser) -> Normaliser:
    """The same with one number more, which stays as it is."""
    wider = Normaliser(len(normaliser.mean) + 1, normaliser.clip).to(normaliser.mean.device)
    wider.mean.copy_(torch.cat([normaliser.mean, normaliser.mean.new_zeros(1)]))
    wider.var.copy_(torch.cat([normaliser.var, normaliser.var.new_ones(1)]))
    return wider
