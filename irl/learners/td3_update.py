"""One update of Stable-Baselines3's TD3 networks, by gradients written out.

With float32 products the weights after an update are those of `TD3.train` within rounding; a test holds it.
What makes it faster is what makes `irl.learners.sac_update` so.
"""

from typing import NamedTuple

import torch
from gymnasium.spaces import Box
from jaxtyping import Float
from stable_baselines3 import TD3
from torch import Tensor

from irl.core import adam
from irl.core.nets import Normaliser
from irl.core.types import Metrics, Transitions
from irl.learners import td3_losses as losses
from irl.learners.inputs import Inputs, acting
from irl.learners.sac_gradients import shares
from irl.learners.sac_losses import td_target
from irl.learners.stack import stacked


class _Last(NamedTuple):
    """What the losses of the last update of the actor are made of."""

    said: Tensor
    target: Tensor
    values: Tensor
    alive: Tensor | None


class TD3Update:
    """The networks of an SB3 TD3, their optimisers, and the step that changes them."""

    def __init__(
        self,
        model: TD3,
        normaliser: Normaliser,
        rng: torch.Generator | None,
        dtype: torch.dtype,
        absorbing_scale: float = 0.0,
    ) -> None:
        """`rng` draws what smooths targets; None is torch's global generator, which SB3 draws from.

        `absorbing_scale` is told of `Inputs`.
        """
        self.model, self.rng = model, rng
        self.updates = 0
        """How many there were; every `policy_delay`-th moves the actor and what follows."""
        box = model.action_space
        assert isinstance(box, Box)
        self.inputs = Inputs(normaliser, box, absorbing_scale)
        self._actor, self._acts_next = (
            stacked([actor.mu], dtype) for actor in (model.actor, model.actor_target)
        )
        self._critics, self._targets = (
            stacked(critic.q_networks, dtype) for critic in (model.critic, model.critic_target)
        )
        trained = (self._actor.flat, self._critics.flat)
        self.optimizers = [torch.optim.Adam([weights], fused=True) for weights in trained]
        self._last: _Last | None = None

    @torch.no_grad()
    def __call__(self, batch: Transitions, reward: Float[Tensor, "B"], lr: float) -> None:
        """Critics; now and then the actor, and then targets follow. Actions in environment units."""
        for optimizer in self.optimizers:
            optimizer.param_groups[0]["lr"] = lr
        alive = acting(batch.absorbing)
        obs = self.inputs.features(batch.obs, batch.absorbing)
        next_obs = self.inputs.features(batch.next_obs, batch.next_absorbing)
        next_value = self._next_value(next_obs, acting(batch.next_absorbing))
        target = td_target(reward, next_value, batch.terminated, self.model.gamma)
        said = self._improve_critics(torch.cat([obs, self.inputs.scaled(batch.action)], 1), target)
        self.updates += 1
        if self.updates % self.model.policy_delay == 0:
            values = self._improve_actor(obs, shares(reward, alive))
            self._last = _Last(said, target, values, alive)
            self._follow()

    def _next_value(
        self, next_obs: Float[Tensor, "B F"], alive: Float[Tensor, "B"] | None
    ) -> Float[Tensor, "B"]:
        """min_i Q_i'(s', a'), a' the target actor's, smoothed."""
        action = torch.tanh(self._acts_next(next_obs)[0][0])
        noise = torch.randn(action.shape, generator=self.rng, device=action.device)
        model = self.model
        action = losses.smoothed(action, noise, model.target_policy_noise, model.target_noise_clip)
        action = self.inputs.followed(action, alive)
        return self._targets(torch.cat([next_obs, action], 1))[0].squeeze(2).amin(0)

    def _improve_critics(
        self, inputs: Float[Tensor, "B I"], target: Float[Tensor, "B"]
    ) -> Float[Tensor, "N B"]:
        """What they said before."""
        said, seen = self._critics(inputs)
        self._critics.differentiate(losses.of_critics(said.squeeze(2), target).unsqueeze(2), seen)
        adam.step(self.optimizers[1])
        self._critics.refresh()
        return said.squeeze(2)

    def _improve_actor(self, obs: Float[Tensor, "B F"], of_rows: Float[Tensor, "B"]) -> Float[Tensor, "B"]:
        """What the first critic said of its actions, before."""
        outputs, seen = self._actor(obs)
        action = torch.tanh(outputs[0])
        said, through = self._critics(torch.cat([obs, action], 1))
        of_said = losses.of_first(said.squeeze(2), of_rows).unsqueeze(2)
        of_action = self._critics.into_inputs(of_said, through)[0, :, obs.shape[1] :]
        self._actor.differentiate(losses.of_tanh(action, of_action).unsqueeze(0), seen)
        adam.step(self.optimizers[0])
        self._actor.refresh()
        return said[0, :, 0]

    def _follow(self) -> None:
        for following, leading in ((self._targets, self._critics), (self._acts_next, self._actor)):
            following.flat.lerp_(leading.flat, self.model.tau)
            following.refresh()

    def refresh(self) -> None:
        """Call it after the weights were loaded."""
        for nets in (self._actor, self._acts_next, self._critics, self._targets):
            nets.refresh()

    def metrics(self) -> Metrics:
        """What the last update that moved the actor was like."""
        if (last := self._last) is None:
            return {}
        return {
            "td3/actor_loss": float(losses.actor_loss(last.values, last.alive)),
            "td3/critic_loss": float(losses.critic_loss(last.said, last.target)),
        }

    def act(self, features: Float[Tensor, "B F"]) -> Float[Tensor, "B A"]:
        """The actor's actions, within [-1, 1]."""
        return torch.tanh(self._actor.values(features)[0])
