"""Values of f where the loss wants them, and slopes of g, h and f where the penalties do."""

from dataclasses import dataclass, fields

import torch
from jaxtyping import Float
from torch import Tensor

from irl.core.flat import linear_layers
from irl.core.perceptron import Perceptron
from irl.discriminators.dropout import Dropped
from irl.rewards.shaped import Inputs, ShapedNet, shaped


@dataclass(frozen=True)
class Slopes:
    """Gradients in the inputs, one row for each of theirs."""

    g: Float[Tensor, "C I"]
    h: Float[Tensor, "C S"]
    """At the state that the step starts in."""
    f: Float[Tensor, "C J"]
    """In state, action and next state, side by side."""


class ShapedSlopes:
    """g and h as their training sees them, by hand (`irl.core.perceptron`)."""

    def __init__(self, net: ShapedNet, gamma: float, dropped: tuple[Dropped, Dropped] | None = None) -> None:
        """`net` is where it will stay: moving it to another device later cuts the tie.

        `dropped` evaluates g and h by autograd where units are left out.
        """
        self._gamma, activation = gamma, net.spec.activation
        self._g: Perceptron | Dropped
        self._h: Perceptron | Dropped
        if dropped is not None:
            self._g, self._h = dropped
            self.trained = [*self._g.trained, *self._h.trained]
            """What an optimiser is given."""
            return
        g = self._g = Perceptron(linear_layers(net.reward), activation)
        h = self._h = Perceptron(linear_layers(net.potential), activation)
        self.trained = [g.flat, h.flat]

    def __call__(self, x: Inputs, sloped: Inputs) -> tuple[Float[Tensor, "B"], Slopes]:
        """The f of each row of `x`, and the slopes at each row of `sloped`; differentiable by the weights."""
        rows, n = len(x.step), len(sloped.step)
        g, of_g = self._g(torch.cat([x.step, sloped.step]), n)
        h, of_h = self._h(torch.cat([x.now, x.after, sloped.now, sloped.after]), 2 * n)
        now, after = of_h[:n], of_h[n:]
        f = shaped(g[:rows], h[:rows], h[rows : 2 * rows], x.kept, self._gamma)
        width = now.shape[1]
        reaching = self._gamma * sloped.kept.unsqueeze(1) * after
        of_f = torch.cat([of_g[:, :width] - now, of_g[:, width:], reaching], 1)
        return f, Slopes(of_g, now, of_f)


def joined(first: Inputs, second: Inputs) -> Inputs:
    """The rows of both."""
    columns = (field.name for field in fields(Inputs))
    return Inputs(*(torch.cat([getattr(first, name), getattr(second, name)]) for name in columns))


def as_rows(x: Inputs) -> Float[Tensor, "B K"]:
    """All columns side by side, so that one draw a row mixes them."""
    return torch.cat([x.step, x.now, x.after, x.kept.unsqueeze(1)], 1)


def from_rows(rows: Float[Tensor, "C K"], like: Inputs) -> Inputs:
    """What `as_rows` put side by side."""
    widths = [like.step.shape[1], like.now.shape[1], like.after.shape[1], 1]
    step, now, after, kept = rows.split(widths, 1)
    return Inputs(step, now, after, kept.squeeze(1))
