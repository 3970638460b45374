"""One update of Stable-Baselines3's SAC networks, faster than its own `train`.

With float32 products the weights after an update are those of `SAC.train` within rounding; a test
holds it. What makes it faster: critics are not differentiated in the actor's step, the networks are
`ReLUNet`s, Adam is fused, and hidden products may be in bfloat16.
"""

import torch
from gymnasium.spaces import Box
from jaxtyping import Bool, Float
from stable_baselines3 import SAC
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from torch import Tensor, nn

from irl.core.nets import Normaliser
from irl.core.types import Metrics, Transitions
from irl.learners.relu_net import ReLUNet, linear_layers
from irl.learners.sac_losses import actor_loss, critic_loss, soft_value, squashed, td_target, temperature_loss


class SACUpdate:
    """The networks of an SB3 SAC, their optimisers, and the step that changes them."""

    def __init__(
        self,
        model: SAC,
        normaliser: Normaliser,
        rng: torch.Generator | None,
        dtype: torch.dtype,
        absorbing_scale: float = 0.0,
    ) -> None:
        """`rng` draws the actions' noise; None is torch's global generator, which SB3 draws from.

        With `absorbing_scale` the networks take one number more than an observation has: that, in the
        absorbing state, else 0.
        """
        self.model, self.rng, self._scale = model, rng, absorbing_scale
        self._mean, self._std, self._clip = normaliser.mean, normaliser.std, normaliser.clip
        actor, device = model.actor, model.device
        assert isinstance(actor.mu, nn.Linear)
        assert isinstance(actor.log_std, nn.Linear)
        assert isinstance(model.log_ent_coef, Tensor)
        self._actor = ReLUNet(linear_layers(actor.latent_pi), [actor.mu, actor.log_std], dtype)
        self._critics = [_value_net(net, dtype) for net in model.critic.q_networks]
        self._targets = [_value_net(net, dtype) for net in model.critic_target.q_networks]
        self._log_temperature = model.log_ent_coef
        trained = ([self._actor.flat], [net.flat for net in self._critics], [self._log_temperature])
        self.optimizers = [torch.optim.Adam(weights, fused=True) for weights in trained]
        box = model.action_space
        assert isinstance(box, Box)
        self._center = torch.as_tensor((box.high + box.low) / 2, device=device)
        self._half = torch.as_tensor((box.high - box.low) / 2, device=device)
        self._losses: dict[str, Tensor] = {}

    def __call__(self, batch: Transitions, reward: Float[Tensor, "B"], lr: float) -> None:
        """Temperature, critics, actor, then the target critics follow. Actions in environment units."""
        for optimizer in self.optimizers:
            optimizer.param_groups[0]["lr"] = lr
        of_actor, of_critics, of_temperature = self.optimizers
        alive, next_alive = _alive(batch.absorbing), _alive(batch.next_absorbing)
        obs = self.features(batch.obs, batch.absorbing)
        next_obs = self.features(batch.next_obs, batch.next_absorbing)
        temperature = self._log_temperature.detach().exp().squeeze()
        action, log_pi = self.sample(obs)
        wanted = float(self.model.target_entropy)
        _step(of_temperature, temperature_loss(self._log_temperature, log_pi, wanted, alive))
        with torch.no_grad():
            next_action, next_log_pi = self.sample(next_obs)
            if next_alive is not None:
                # the action of s_abs is 0: decided by where the step leads, not by where it starts
                none = self.scaled(torch.zeros_like(next_action))
                next_action = torch.where(next_alive.unsqueeze(1) > 0, next_action, none)
            next_q = _q(self._targets, next_obs, next_action).amin(0)
            value = soft_value(next_q, next_log_pi, temperature, next_alive)
            target = td_target(reward, value, batch.terminated, self.model.gamma)
        critics = critic_loss(_q(self._critics, obs, self.scaled(batch.action)), target)
        _step(of_critics, critics, *self._critics)
        value = _q(self._critics, obs, action, frozen=True).amin(0)
        actor = actor_loss(value, log_pi, temperature, alive)
        _step(of_actor, actor, self._actor)
        self._follow()
        losses = {"actor_loss": actor.detach(), "critic_loss": critics.detach(), "ent_coef": temperature}
        self._losses = losses

    @torch.no_grad()
    def _follow(self) -> None:
        for target, net in zip(self._targets, self._critics, strict=True):
            target.flat.lerp_(net.flat, self.model.tau)
            target.refresh()

    def refresh(self) -> None:
        """Call it after the weights were loaded."""
        for net in (self._actor, *self._critics, *self._targets):
            net.refresh()

    def features(
        self, obs: Float[Tensor, "B O"], absorbing: Bool[Tensor, "B"] | None = None
    ) -> Float[Tensor, "B F"]:
        """Normalised observations, zeros in s_abs, and its indicator; the moments are read once."""
        normal = ((obs - self._mean) / self._std).clamp_(-self._clip, self._clip)
        if not self._scale:
            return normal
        if absorbing is None:
            return torch.cat([normal, normal.new_zeros(len(obs), 1)], 1)
        flag = absorbing.unsqueeze(1)
        return torch.cat([normal.masked_fill_(flag, 0.0), self._scale * flag.to(normal.dtype)], 1)

    def metrics(self) -> Metrics:
        """What the last update was like."""
        return {f"sac/{name}": float(value) for name, value in self._losses.items()}

    def sample(self, features: Float[Tensor, "B F"]) -> tuple[Float[Tensor, "B A"], Float[Tensor, "B"]]:
        """Actions within [-1, 1] for normalised observations, and their log pi."""
        mean, log_std = self._actor(features).chunk(2, dim=1)
        noise = torch.randn(mean.shape, generator=self.rng, device=mean.device)
        return squashed(mean, log_std.clamp(LOG_STD_MIN, LOG_STD_MAX), noise)

    def scaled(self, action: Float[Tensor, "B A"]) -> Float[Tensor, "B A"]:
        """Environment units to [-1, 1]."""
        return (action - self._center) / self._half

    def unscaled(self, action: Float[Tensor, "B A"]) -> Float[Tensor, "B A"]:
        """[-1, 1] to environment units."""
        return action * self._half + self._center


def _alive(absorbing: Bool[Tensor, "B"] | None) -> Float[Tensor, "B"] | None:
    return None if absorbing is None else (~absorbing).float()


def _value_net(net: nn.Module, dtype: torch.dtype) -> ReLUNet:
    *body, last = linear_layers(net)
    return ReLUNet(body, [last], dtype)


def _q(nets: list[ReLUNet], obs: Tensor, action: Tensor, frozen: bool = False) -> Float[Tensor, "N B"]:
    x = torch.cat([obs, action], 1)
    return torch.stack([net(x, frozen).squeeze(1) for net in nets])


def _step(optimizer: torch.optim.Optimizer, loss: Tensor, *nets: ReLUNet) -> None:
    optimizer.zero_grad()
    loss.backward()
    optimizer.step()
    for net in nets:
        net.refresh()
