"""One update of Stable-Baselines3's SAC networks, faster than its own `train`.

With float32 products the weights after an update are those of `SAC.train` within rounding; a test
holds it. What makes it faster: gradients are written out (`sac_gradients`), the critics are one stack of
networks and are not differentiated in the actor's step, the actor sees both ends of a step at once, Adam
is fused, and hidden products may be in bfloat16.
"""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3 import SAC
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from torch import Tensor, nn

from irl.core import adam
from irl.core.flat import linear_layers
from irl.core.nets import Normaliser
from irl.core.types import Metrics, Transitions
from irl.learners import sac_gradients as gradients
from irl.learners.heads import Head, Lowest
from irl.learners.inputs import Inputs, acting
from irl.learners.sac_losses import actor_loss, soft_value, squashed, td_target
from irl.learners.stack import Stack, stacked


class _Drawn(NamedTuple):
    """Actions within [-1, 1], and what their gradients are made of."""

    action: Tensor
    log_pi: Tensor
    moved: Tensor
    """How far the noise moved them before the squashing."""
    log_std: Tensor
    """The actor's, before its bounds."""


class _Last(NamedTuple):
    """What the losses of the last update are made of."""

    said: Tensor
    target: Tensor
    values: Tensor
    log_pi: Tensor
    temperature: Tensor
    alive: Tensor | None


class SACUpdate:
    """The networks of an SB3 SAC, their optimisers, and the step that changes them."""

    def __init__(
        self,
        model: SAC,
        normaliser: Normaliser,
        rng: torch.Generator | None,
        dtype: torch.dtype,
        absorbing_scale: float = 0.0,
        head: Head | None = None,
    ) -> None:
        """`rng` draws the actions' noise; None is torch's global generator, which SB3 draws from.

        `head` says what the critics' outputs are; one number each unless given. `absorbing_scale` is told
        of `Inputs`.
        """
        self.model, self.rng, self._head = model, rng, head or Lowest()
        box = model.action_space
        assert isinstance(box, Box)
        self.inputs = Inputs(normaliser, box, absorbing_scale)
        self.updates = 0
        """How many there were."""
        actor = model.actor
        assert isinstance(actor.mu, nn.Linear)
        assert isinstance(actor.log_std, nn.Linear)
        self._actor = Stack([linear_layers(actor.latent_pi)], [[actor.mu, actor.log_std]], dtype=dtype)
        self._critics = stacked(model.critic.q_networks, dtype)
        self._targets = stacked(model.critic_target.q_networks, dtype)
        # SB3 has a logarithm of a temperature that is learned, and the number of one that stays
        self._learns_temperature = model.log_ent_coef is not None
        learned = model.log_ent_coef if self._learns_temperature else model.ent_coef_tensor.log().reshape(1)
        assert isinstance(learned, Tensor)
        self._log_temperature = learned.detach()
        self._log_temperature.grad = torch.zeros_like(self._log_temperature)
        trained = (self._actor.flat, self._critics.flat, self._log_temperature)
        self.optimizers = [torch.optim.Adam([weights], fused=True) for weights in trained]
        self._last: _Last | None = None

    @torch.no_grad()
    def __call__(self, batch: Transitions, reward: Float[Tensor, "B"], lr: float) -> None:
        """Temperature, critics, actor, then the target critics follow. Actions in environment units."""
        for optimizer in self.optimizers:
            optimizer.param_groups[0]["lr"] = lr
        size, alive, next_alive = len(batch), acting(batch.absorbing), acting(batch.next_absorbing)
        obs = self.inputs.features(batch.obs, batch.absorbing)
        next_obs = self.inputs.features(batch.next_obs, batch.next_absorbing)
        temperature = self._log_temperature.exp().squeeze()
        outputs, activations = self._actor(torch.cat([obs, next_obs]))
        drawn, following = self._sampled(outputs[0], size)
        shares = gradients.shares(drawn.log_pi, alive)

        if self._learns_temperature:
            self._improve_temperature(drawn.log_pi, shares)
        next_value = self._next_value(next_obs, following, temperature, next_alive)
        target = td_target(reward, next_value, batch.terminated, self.model.gamma)
        said = self._improve_critics(torch.cat([obs, self.inputs.scaled(batch.action)], 1), target)
        seen = [h[:, :size] for h in activations]
        values = self._improve_actor(obs, drawn, seen, shares, temperature)
        self._last = _Last(said, target, values, drawn.log_pi, temperature, alive)
        self.updates += 1
        if self.updates % self.model.target_update_interval == 0:
            self._targets.flat.lerp_(self._critics.flat, self.model.tau)
            self._targets.refresh()

    def _improve_temperature(self, log_pi: Float[Tensor, "B"], shares: Float[Tensor, "B"]) -> None:
        excess = log_pi + float(self.model.target_entropy)
        torch.sum(-shares * excess, 0, keepdim=True, out=self._log_temperature.grad)
        adam.step(self.optimizers[2])

    def _next_value(
        self,
        next_obs: Float[Tensor, "B F"],
        drawn: _Drawn,
        temperature: Float[Tensor, ""],
        alive: Float[Tensor, "B"] | None,
    ) -> Float[Tensor, "M B"]:
        action = self.inputs.followed(drawn.action, alive)
        ahead = self._head.ahead(self._targets(torch.cat([next_obs, action], 1))[0])
        return soft_value(ahead, drawn.log_pi, temperature, alive)

    def _improve_critics(
        self, inputs: Float[Tensor, "B I"], target: Float[Tensor, "M B"]
    ) -> Float[Tensor, "N B K"]:
        """What they said before."""
        said, seen = self._critics(inputs)
        self._critics.differentiate(self._head.of_loss(said, target), seen)
        adam.step(self.optimizers[1])
        self._critics.refresh()
        return said

    def _improve_actor(
        self,
        obs: Float[Tensor, "B F"],
        drawn: _Drawn,
        seen: Sequence[Tensor],
        shares: Float[Tensor, "B"],
        temperature: Float[Tensor, ""],
    ) -> Float[Tensor, "B"]:
        """What the critics said of its actions, before; `seen` is what the actor's layers made of `obs`."""
        said, through = self._critics(torch.cat([obs, drawn.action], 1))
        of_inputs = self._critics.into_inputs(self._head.of_value(said, shares), through)
        of_action, of_log_pi = of_inputs[:, :, obs.shape[1] :].sum(0), temperature * shares
        of_mean, of_log_std = gradients.of_squashed(drawn.action, drawn.moved, of_action, of_log_pi)
        of_log_std = of_log_std * (drawn.log_std == drawn.log_std.clamp(LOG_STD_MIN, LOG_STD_MAX))
        self._actor.differentiate(torch.cat([of_mean, of_log_std], 1).unsqueeze(0), seen)
        adam.step(self.optimizers[0])
        self._actor.refresh()
        return self._head.value(said)

    def refresh(self) -> None:
        """Call it after the weights were loaded."""
        for nets in (self._actor, self._critics, self._targets):
            nets.refresh()

    def metrics(self) -> Metrics:
        """What the last update was like."""
        if (last := self._last) is None:
            return {}
        of_actor = actor_loss(last.values, last.log_pi, last.temperature, last.alive)
        of_critics = self._head.loss(last.said, last.target)
        return {
            "sac/actor_loss": float(of_actor),
            "sac/critic_loss": float(of_critics),
            "sac/ent_coef": float(last.temperature),
        }

    def sample(self, features: Float[Tensor, "B F"]) -> Float[Tensor, "B A"]:
        """Actions within [-1, 1] for normalised observations."""
        mean, log_std = self.gaussian(features)
        return torch.tanh(mean + log_std.exp() * self._noise(mean))

    def gaussian(self, features: Float[Tensor, "B F"]) -> tuple[Float[Tensor, "B A"], Float[Tensor, "B A"]]:
        """Mean and log deviation of the actions before the squashing."""
        mean, log_std = self._actor.values(features)[0].chunk(2, dim=1)
        return mean, log_std.clamp(LOG_STD_MIN, LOG_STD_MAX)

    def _sampled(self, outputs: Float[Tensor, "N C"], size: int) -> tuple[_Drawn, _Drawn]:
        """Of both ends of a step, drawn one after the other as SB3 does."""
        mean, log_std = outputs.chunk(2, dim=1)
        noise = torch.cat([self._noise(mean[:size]), self._noise(mean[size:])])
        bounded = log_std.clamp(LOG_STD_MIN, LOG_STD_MAX)
        parts = (*squashed(mean, bounded, noise), bounded.exp() * noise, log_std)
        return _Drawn(*(of[:size] for of in parts)), _Drawn(*(of[size:] for of in parts))

    def _noise(self, like: Float[Tensor, "B A"]) -> Float[Tensor, "B A"]:
        return torch.randn(like.shape, generator=self.rng, device=like.device)
