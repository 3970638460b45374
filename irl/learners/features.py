"""The observation normaliser as SB3's feature extractor, so that it travels with the policy."""

from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor

from irl.core.nets import Normaliser


class NormalisedFeatures(BaseFeaturesExtractor):
    """Features of an observation: the observation, normalised."""

    def __init__(self, observation_space: Box, normaliser: Normaliser | None = None) -> None:
        """`normaliser` is used as it is; without one, a fresh one is."""
        super().__init__(observation_space, features_dim=observation_space.shape[0])
        self.normaliser = normaliser or Normaliser(observation_space.shape[0])

    def forward(self, obs: Float[Tensor, "B O"]) -> Float[Tensor, "B O"]:
        """Normalised observations."""
        return self.normaliser(obs)
