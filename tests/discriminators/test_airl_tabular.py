"""On a task of four states whose every quantity is known, g is the reward that made the expert.

    action 0 stays, action 1 goes on around a ring;   r(s) is 0, 1, -1/2 or 2

Each state and the next are reached in one step from one state, so that g(s) is the reward up to one
constant for all, and h the soft value up to one (Fu et al. 2018, arXiv:1710.11248). Policies and
occupancies are exact: what is wrong is wrong in the discriminator.
"""

import torch
from torch import Tensor

from irl.core.nets import Normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.discriminators.airl import AIRL, AIRLConfig

GAMMA = 0.9
REWARD = torch.tensor([0.0, 1.0, -0.5, 2.0])
N = len(REWARD)
NEXT = torch.stack([torch.arange(N), (torch.arange(N) + 1) % N], 1)
"""[state, action] -> state."""
STATES, ACTIONS = torch.eye(N), torch.eye(2)


def table(visits: Tensor) -> Transitions:
    """Every pair of state and action, weighing its visits."""
    never = torch.zeros(2 * N, dtype=torch.bool)
    obs, next_obs = STATES.repeat_interleave(2, 0), STATES[NEXT.flatten()]
    return Transitions(obs, ACTIONS.repeat(N, 1), next_obs, never, never, weight=visits.flatten())


def soft_optimal(reward: Tensor) -> tuple[Tensor, Tensor]:
    """Policy [state, action] and value of the best sum of reward and entropy; reward [state, action]."""
    value = torch.zeros(N)
    for _ in range(100):
        q = reward + GAMMA * value[NEXT]
        value = torch.logsumexp(q, 1)
    return torch.softmax(reward + GAMMA * value[NEXT], 1), value


def visited(policy: Tensor) -> Tensor:
    """Discounted visits of each pair, from a uniform start."""
    steps = torch.zeros(N, N).scatter_add_(1, NEXT, policy)
    of_states = torch.linalg.solve(torch.eye(N) - GAMMA * steps.T, torch.full((N,), (1 - GAMMA) / N))
    return of_states[:, None] * policy


def test_g_is_the_reward_and_h_the_value_each_up_to_a_constant() -> None:
    expert, value = soft_optimal(REWARD[:, None].expand(N, 2))
    policy = torch.full((N, 2), 0.5)

    def log_pi(batch: Transitions) -> Tensor:
        return policy[batch.obs.argmax(1), batch.action.argmax(1)].log()

    airl = AIRL(
        N,
        2,
        AIRLConfig(
            inputs="obs",
            hidden=(),
            potential_hidden=(),
            lr=0.1,
            terminal="mask",
            gradient_penalty=0.0,
            log_pi_bound=10.0,
        ),
        log_pi=log_pi,
        gamma=GAMMA,
        normaliser=Normaliser(N),
        init_rng=torch_stream(0, "weights"),
        rng=torch_stream(0, "rest"),
    )
    for round_ in range(40):
        if round_ == 25:
            airl.optimizer.param_groups[0]["lr"] = 0.01
        for _ in range(8):
            airl.update(table(visited(expert)), table(visited(policy)))
        with torch.no_grad():
            f = airl.net.f(table(visited(policy)), GAMMA).reshape(N, 2)
        policy = soft_optimal(f)[0]
    states = table(visited(policy))[::2]
    g, h = airl.net.g(states).detach(), airl.net.h(states).detach()
    assert float((policy - expert).abs().max()) < 0.02
    assert float((g - REWARD - (g - REWARD).mean()).abs().max()) < 0.1
    assert float((h - value - (h - value).mean()).abs().max()) < 0.1
