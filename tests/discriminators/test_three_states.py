"""Two tasks of three states, in which an early end is good or bad, solved to the bottom.

    0 --go--> 1 --back--> 0        1 --exit--> end

The discriminators are the package's own; occupancies and values are exact, so nothing else can be at
fault. In `leave` the expert goes and exits; in `stay` it goes back and forth for ever. A reward that is
never negative pays for staying, one that is never positive for leaving, whatever the expert does.
"""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from irl.core.nets import Normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.discriminators.dac import DAC, DACConfig
from irl.discriminators.gail import GAIL, GAILConfig
from irl.envs.absorbing import absorb

GAMMA, ROUNDS, STEPS = 0.97, 150, 6
PAIRS = Transitions(  # (0, go), (1, back), (1, exit)
    obs=torch.tensor([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0]]),
    action=torch.tensor([[1.0], [-1.0], [1.0]]),
    next_obs=torch.tensor([[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]),
    terminated=torch.tensor([False, False, True]),
    truncated=torch.tensor([False, False, False]),
)


def visits(exit_: float) -> Transitions:
    """Every pair with its discounted visits, from 0, of the policy that exits in 1 so often."""
    in_1 = GAMMA / (1.0 - GAMMA**2 * (1.0 - exit_))
    of_pairs = torch.tensor([1.0 + GAMMA * (1.0 - exit_) * in_1, (1.0 - exit_) * in_1, exit_ * in_1])
    return replace(PAIRS, weight=of_pairs)


def with_absorbing(batch: Transitions) -> Transitions:
    """The same going on in s_abs, which is visited gamma / (1 - gamma) times after each exit."""
    led = absorb(batch)
    assert led.weight is not None
    assert led.absorbing is not None
    return replace(led, weight=torch.where(led.absorbing, led.weight * GAMMA / (1.0 - GAMMA), led.weight))


def improved(logit: float, reward: Tensor) -> float:
    """One step of mirror descent on the logit of exiting, by exact values of the policy."""
    exit_ = float(torch.sigmoid(torch.tensor(logit)))
    go, back, leave = reward.tolist()
    # V(1) = p leave + (1 - p) (back + gamma (go + gamma V(1)))
    value = (exit_ * leave + (1 - exit_) * (back + GAMMA * go)) / (1 - (1 - exit_) * GAMMA**2)
    return max(-8.0, min(8.0, logit + 0.3 * (leave - back - GAMMA * (go + GAMMA * value))))


def exits(expert_exits: float, discriminator: GAIL) -> float:
    """How often the policy exits in 1 after both have learned."""
    absorbing = discriminator.config.absorbing_scale > 0
    expert = with_absorbing(visits(expert_exits)) if absorbing else visits(expert_exits)
    logit = 0.0
    for _ in range(ROUNDS):
        policy = visits(float(torch.sigmoid(torch.tensor(logit))))
        for _ in range(STEPS):
            discriminator.update(expert, with_absorbing(policy) if absorbing else policy)
        logit = improved(logit, discriminator.reward(PAIRS))
    return float(torch.sigmoid(torch.tensor(logit)))


def made(method: str) -> GAIL:
    shape = {"hidden": (32,), "lr": 3e-3}
    rngs = {"init_rng": torch_stream(0, "weights"), "rng": torch_stream(0, "rest"), "gamma": GAMMA}
    if method == "dac":
        return DAC(2, 1, DACConfig(**shape), normaliser=Normaliser(2), **rngs)
    config = GAILConfig(**shape, gradient_penalty=10.0, reward_map=method)  # pyright: ignore[reportArgumentType]
    return GAIL(2, 1, config, normaliser=Normaliser(2), **rngs)


@pytest.mark.parametrize(
    ("method", "leave", "stay"),
    [("dac", True, True), ("gail", False, True), ("log_d", True, False)],
    ids=["DAC does both", "-log(1 - D) cannot leave", "log D cannot stay"],
)
def test_who_can_leave_and_who_can_stay(method: str, leave: bool, stay: bool) -> None:
    assert (exits(1.0, made(method)) > 0.9) == leave
    assert (exits(0.0, made(method)) < 0.1) == stay
