"""A rollout of an SB3 PPO beside its gradient steps: rewards, and densities of its actions."""

import numpy as np
import torch
from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3 import PPO
from torch import Tensor

from irl.core.finite import check_finite
from irl.core.types import RewardFn, Transitions
from irl.policies import densities
from irl.rewards.normalise import ReturnScale


@torch.no_grad()
def give_rewards(
    model: PPO, scale: ReturnScale, batch: Transitions, reward: RewardFn
) -> Float[np.ndarray, "T N"]:
    """Reward the model's rollout buffer, whose steps `batch` are, and compute its advantages anew.

        r'_t = r_t / std(G) + [truncated at t] gamma V(s_{t+1})

    Returns the rewards before their scaling, which moves `scale` on.

    Raises:
        NotFinite: a reward is NaN or infinite.
    """
    buffer, shape = model.rollout_buffer, model.rollout_buffer.rewards.shape
    given = reward(batch)
    check_finite({"reward of the rollout": given})
    raw = given.double().cpu().numpy().reshape(shape)
    ended = (batch.terminated | batch.truncated).cpu().numpy().reshape(shape)
    scale.update(raw, ended)
    buffer.rewards[:] = raw / scale.std
    cut_off = batch.truncated & ~batch.terminated
    if bool(cut_off.any()):
        values = model.policy.predict_values(batch.next_obs[cut_off].to(model.device))
        where = cut_off.cpu().numpy().reshape(shape)
        buffer.rewards[where] += model.gamma * values.flatten().cpu().numpy()
    assert isinstance(model._last_obs, np.ndarray)
    assert model._last_episode_starts is not None
    last_obs = torch.as_tensor(model._last_obs, device=model.device)
    buffer.compute_returns_and_advantage(model.policy.predict_values(last_obs), model._last_episode_starts)
    return raw


@torch.no_grad()
def log_pi(model: PPO, batch: Transitions) -> Float[Tensor, "B"]:
    """Log density of the batch's own actions, as the environment saw them, under the current policy.

    `irl.policies.densities.clipped`; no normaliser moves and nothing is drawn.

    Raises:
        ValueError: the policy's actions are no clipped Gaussians.
    """
    policy, box = model.policy, model.action_space
    policy.set_training_mode(False)
    normal = policy.get_distribution(batch.obs).distribution
    if model.use_sde or not (isinstance(normal, torch.distributions.Normal) and isinstance(box, Box)):
        raise ValueError("AIRL needs the density of an action: a PPO of Gaussian actions, without use_sde")
    low, high = (torch.as_tensor(bound, device=batch.obs.device) for bound in (box.low, box.high))
    return densities.clipped(batch.action, normal.mean, normal.stddev.log(), low, high)
