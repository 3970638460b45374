"""MuJoCo's hand-written rewards as functions of (s, a, s'), by the velocity in place of the hidden position.

    recorded    (x' - x) / dt + ...          x is not in the observation
    this form   (v + v') / 2  + ...          v the velocity along x, which is

Both ends' mean is the displacement to second order. Velocities that the observation clips are clipped here,
and nothing else differs but what the row says. For distances that invent steps (EPIC), and to say how near
the two forms are: 0.003 by the default distance on HalfCheetah.
"""

from dataclasses import dataclass

from jaxtyping import Float
from torch import Tensor

from irl.core.errors import UserError
from irl.core.types import Transitions


@dataclass(frozen=True)
class VelocityForm:
    """v along x, less the cost of actions, and a bonus for each step that does not end the episode."""

    column: int
    """Of the velocity along x, in the observation."""
    ctrl: float
    survive: float

    def __call__(self, batch: Transitions) -> Float[Tensor, "B"]:
        velocity = (batch.obs[:, self.column] + batch.next_obs[:, self.column]).double() / 2.0
        alive = (~batch.terminated).double()
        return velocity - self.ctrl * batch.action.double().square().sum(1) + self.survive * alive


FORMS = {
    "Hopper-v5": VelocityForm(5, 1e-3, 1.0),
    "HalfCheetah-v5": VelocityForm(8, 0.1, 0.0),
    "Walker2d-v5": VelocityForm(8, 1e-3, 1.0),
    "Swimmer-v5": VelocityForm(3, 1e-4, 0.0),
}
"""Tasks whose other terms are functions of action and end alone, with gymnasium's default weights."""


def of_task(env_id: str) -> VelocityForm:
    """The form of a task.

    Raises:
        UserError: there is none for it.
    """
    if env_id not in FORMS:
        raise UserError(
            f"the reward of {env_id} has no form in velocities; there is one for {', '.join(FORMS)}"
        )
    return FORMS[env_id]
