"""The two networks behind an AIRL reward: g says what a step is worth, h shapes it.

    f(s, a, s') = g(s, a) + gamma h(s') - h(s)                       (g(s) where it is not to see actions)

Source: Fu et al. (2018), arXiv:1710.11248.

Where an episode ends, two ways. Without an absorbing state h(s') is left out at a termination, and only
there: what a time limit cut off goes on. With one (`absorbing_scale` c > 0) a termination leads into s_abs,
which has a learned g and h like any other state; both networks see one number more, as in `irl.rewards.nets`:

    x(s) = [normalise(s) (1 - z), c z],   z = 1 in s_abs, else 0

A recorded step that terminated is one into s_abs, and is paid what follows (`irl.rewards.tail`):

    g: g(s, a) + gamma / (1 - gamma) g(s_abs),    f: f(s, a, s_abs) + gamma / (1 - gamma) f(s_abs, 0, s_abs)

The second holds h(s_abs) no more: gamma h(s_abs) goes out against gamma / (1 - gamma) (gamma - 1) h(s_abs).
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from irl.core.config import check_at_least
from irl.core.nets import Normaliser, mlp
from irl.core.types import Transitions
from irl.rewards import tail

PARTS = ("g", "f")
"""What can be asked of a shaped reward."""

ENTROPIC = "f-log-pi"
"""And of one whose policy is beside it: f less the log density of the policy of that time."""


@dataclass(frozen=True)
class ShapedSpec:
    """The shape of g and h."""

    KIND: ClassVar[str] = "shaped"
    obs_dim: int
    action_dim: int
    hidden: tuple[int, ...] = (100, 100)
    """Of g."""
    potential_hidden: tuple[int, ...] = (100, 100)
    """Of h."""
    activation: str = "tanh"
    inputs: Literal["obs", "obs_action"] = "obs_action"
    """What g sees."""
    absorbing_scale: float = 0.0
    """What the indicator of s_abs is multiplied by; 0: the networks know no s_abs."""
    log_pi_bound: float = 10.0
    """Beside which log pi it was learned: one kept within this of 0."""

    def __post_init__(self) -> None:
        check_at_least(self, 0, "absorbing_scale", "log_pi_bound")

    @property
    def state(self) -> int:
        """Numbers that say which state it is."""
        return self.obs_dim + (self.absorbing_scale > 0)

    @property
    def sees(self) -> str:
        """What g judges a step by, as a logit's specification calls it."""
        return self.inputs

    @property
    def sizes(self) -> tuple[tuple[int, ...], ...]:
        """Units of each layer, of g and of h."""
        seen = self.state + (self.action_dim if self.inputs == "obs_action" else 0)
        return (seen, *self.hidden, 1), (self.state, *self.potential_hidden, 1)


@dataclass(frozen=True)
class Inputs:
    """What g and h see of a batch, normalised."""

    step: Float[Tensor, "B I"]
    """The state, then the action where g sees it."""
    now: Float[Tensor, "B S"]
    after: Float[Tensor, "B S"]
    kept: Float[Tensor, "B"]
    """0 where h(s') is left out, else 1."""


class ShapedNet(nn.Module):
    """g and h, and f made of them."""

    def __init__(self, spec: ShapedSpec, normaliser: Normaliser, generator: torch.Generator) -> None:
        super().__init__()
        self.spec, self.normaliser = spec, normaliser
        of_g, of_h = spec.sizes
        self.reward = mlp(of_g, spec.activation, generator)
        self.potential = mlp(of_h, spec.activation, generator)

    def inputs(self, batch: Transitions) -> Inputs:
        """What the networks see; a termination is a step into s_abs, or one after which h counts no more.

        Raises:
            ValueError: the batch has a step in s_abs, and the networks know none.
        """
        into, now = batch.terminated, self._state(batch.obs, batch.absorbing)
        if self.spec.absorbing_scale:
            into = into if batch.next_absorbing is None else into | batch.next_absorbing
            after, kept = self._state(batch.next_obs, into), torch.ones_like(now[:, 0])
        else:
            after, kept = self._state(batch.next_obs, batch.next_absorbing), (~into).to(now.dtype)
        step = torch.cat([now, batch.action], 1) if self.spec.inputs == "obs_action" else now
        return Inputs(step, now, after, kept)

    def _state(self, obs: Float[Tensor, "B O"], absorbing: Bool[Tensor, "B"] | None) -> Float[Tensor, "B S"]:
        normal, scale = self.normaliser(obs), self.spec.absorbing_scale
        if not scale:
            if absorbing is not None and bool(absorbing.any()):
                raise ValueError(
                    "the batch has steps in the absorbing state, which these networks do not know"
                )
            return normal
        if absorbing is None:
            return torch.cat([normal, normal.new_zeros(len(obs), 1)], 1)
        flag = absorbing.unsqueeze(1)
        return torch.cat([normal.masked_fill(flag, 0.0), scale * flag.to(normal.dtype)], 1)

    def g(self, batch: Transitions) -> Float[Tensor, "B"]:
        """What each step is worth by itself."""
        return self.reward(self.inputs(batch).step).squeeze(1)

    def h(self, batch: Transitions) -> Float[Tensor, "B"]:
        """The potential of the state that each step starts in."""
        return self.potential(self.inputs(batch).now).squeeze(1)

    def f(self, batch: Transitions, gamma: float) -> Float[Tensor, "B"]:
        """What each step is worth, shaped."""
        x = self.inputs(batch)
        of_g, now, after = self.reward(x.step), self.potential(x.now), self.potential(x.after)
        return shaped(of_g.squeeze(1), now.squeeze(1), after.squeeze(1), x.kept, gamma)

    def of_absorbing(self) -> Float[Tensor, "1"]:
        """The g of s_abs, where the action is 0.

        Raises:
            ValueError: the networks know no s_abs.
        """
        if not self.spec.absorbing_scale:
            raise ValueError("these networks know no absorbing state")
        (seen, *_), _ = self.spec.sizes
        return self.reward(self._flag(seen)).squeeze(1)

    def _flag(self, width: int) -> Float[Tensor, "1 W"]:
        """What says s_abs, and zeros."""
        x = self.normaliser.mean.new_zeros(1, width)
        x[:, self.spec.obs_dim] = self.spec.absorbing_scale
        return x

    def paid(self, part: str, batch: Transitions, gamma: float) -> Float[Tensor, "B"]:
        """`part` of each step as a learner is paid it: at a termination with what s_abs pays.

        Raises:
            ValueError: there is no such part, or a tail is needed and gamma is not below 1.
        """
        if part not in PARTS:
            raise ValueError(f"unknown part {part!r}; known: {', '.join(PARTS)}")
        of_steps = self.g(batch) if part == "g" else self.f(batch, gamma)
        if not self.spec.absorbing_scale or not bool(batch.terminated.any()):
            return of_steps
        return tail.added(of_steps, self.a_step_in_absorbing(part, gamma), batch, gamma)

    def a_step_in_absorbing(self, part: str, gamma: float) -> Float[Tensor, "1"]:
        """What `part` of the step s_abs -> s_abs is.

        Raises:
            ValueError: the networks know no s_abs.
        """
        g = self.of_absorbing()
        if part == "g":
            return g
        h = self.potential(self._flag(self.spec.state)).squeeze(1)
        return shaped(g, h, h, torch.ones_like(h), gamma)


def shaped(
    g: Float[Tensor, "B"],
    now: Float[Tensor, "B"],
    after: Float[Tensor, "B"],
    kept: Float[Tensor, "B"],
    gamma: float,
) -> Float[Tensor, "B"]:
    """The f = g + gamma h(s') - h(s), with h(s') only where it is kept.

    Over an episode the discounted potentials cancel but for h(s_0), which no action changes, and the last,
    gamma^T h(s_T): kept after a time limit, where a value goes on too, left out after a termination.

    Source: Fu et al. (2018), arXiv:1710.11248.
    """
    return g + gamma * kept * after - now
