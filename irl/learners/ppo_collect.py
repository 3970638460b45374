"""A rollout as Stable-Baselines3's PPO collects it, of a Gaussian policy, without what only SB3 asks for.

Noise is drawn as SB3 draws it and actions come of the same calls in the same order: they are the same to the
bit. Values and densities of the actions, which nothing needs while the rollout goes on, are computed at its
end in one batch; they are SB3's within rounding. The reward is zero, as `Recorder` tells SB3.

    a = mean(s) + std z,   log pi(a | s) = log N(z) - sum(log std),   the environment sees clip(a, low, high)
"""

from collections.abc import Callable

import numpy as np
import torch
import torch.nn.functional as F
from gymnasium.spaces import Box
from stable_baselines3 import PPO
from torch import Tensor, nn

from irl.core.flat import linear_layers
from irl.learners import ppo_losses as losses
from irl.learners.features import NormalisedFeatures
from irl.learners.vec import RecordingVecEnv


@torch.inference_mode()
def collect(model: PPO, venv: RecordingVecEnv, activation: str) -> None:
    """Fill the model's rollout buffer with one rollout; rewards and advantages are left at zero."""
    buffer, device = model.rollout_buffer, model.device
    obs, starts = model._last_obs, model._last_episode_starts
    assert isinstance(obs, np.ndarray)
    assert starts is not None
    model.policy.set_training_mode(False)
    buffer.reset()
    means, std = _means(model, activation), model.policy.log_std.exp()
    zeros = torch.zeros(model.n_envs, buffer.action_dim, device=device)
    ones, z = torch.ones_like(zeros), zeros.new_empty(buffer.buffer_size, *zeros.shape)
    low, high = (torch.from_numpy(end) for end in _bounds(model))
    for t in range(buffer.buffer_size):
        buffer.observations[t], buffer.episode_starts[t] = obs, starts
        torch.normal(zeros, ones, out=z[t])
        action = (means(torch.from_numpy(obs).to(device, torch.float32)) + z[t] * std).cpu()
        buffer.actions[t] = action.numpy()
        obs, starts = venv.advance(torch.minimum(torch.maximum(action, low), high).numpy())
    model._last_obs, model._last_episode_starts = obs, starts
    model.num_timesteps += buffer.buffer_size * model.n_envs
    rows = torch.from_numpy(buffer.observations.reshape(-1, *buffer.obs_shape)).to(device, torch.float32)
    buffer.values[:] = model.policy.predict_values(rows).cpu().numpy().reshape(buffer.values.shape)
    log_pi = losses.log_density(z.flatten(0, 1), model.policy.log_std)
    buffer.log_probs[:] = log_pi.cpu().numpy().reshape(buffer.values.shape)
    buffer.pos, buffer.full = buffer.buffer_size, True


def _means(model: PPO, activation: str) -> Callable[[Tensor], Tensor]:
    """The policy's mean of actions, as its modules compute it; the weights are not to change meanwhile."""
    extractor, head = model.policy.features_extractor, model.policy.action_net
    assert isinstance(extractor, NormalisedFeatures)
    assert isinstance(head, nn.Linear)
    layers = [(m.weight, m.bias) for m in linear_layers(model.policy.mlp_extractor.policy_net)]
    # torch's own tanh: that of `core.phi` differs from SB3's in its last bit
    normaliser, act = extractor.normaliser, torch.tanh_ if activation == "tanh" else torch.relu_
    mean, std, clip = normaliser.mean, normaliser.std, normaliser.clip

    def means(obs: Tensor) -> Tensor:
        h = ((obs - mean) / std).clamp(-clip, clip)
        for weight, bias in layers:
            h = act(F.linear(h, weight, bias))
        return F.linear(h, head.weight, head.bias)

    return means


def _bounds(model: PPO) -> tuple[np.ndarray, np.ndarray]:
    box = model.action_space
    assert isinstance(box, Box)
    return box.low, box.high
