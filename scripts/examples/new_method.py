"""A new method in 60 lines: least-squares GAIL, which irl does not have.

    D  <-  argmin  E_expert[(h(s,a) - 1)^2] + E_policy[(h(s,a) + 1)^2]     as least-squares GANs have it
    r  =   1 - (h(s,a) - 1)^2 / 4                                          at most 1, for a sure expert

A method is a loss, a penalty and a map from the logit to the reward. Collecting, rewarding after the rollout,
time limits, normalisers, checkpoints and all the rest are irl's.

    python scripts/examples/new_method.py irl/hopper/expert-v0 --env-id Hopper-v5
"""

import copy
from typing import Any

import torch
import tyro
from jaxtyping import Float
from torch import Tensor

from irl import Transitions, from_episodes, load_demos
from irl.algorithms.adversarial import Adversarial, ScheduleConfig
from irl.core.nets import Normaliser, fitted_normaliser
from irl.core.rng import episode_seeds, torch_stream
from irl.core.types import Metrics
from irl.discriminators.regularisers import between, slope_penalty
from irl.discriminators.slopes import input_gradient
from irl.learners.ppo import PPOConfig, PPOLearner
from irl.rewards.nets import LogitNet, LogitSpec


class LeastSquares:
    """What `Adversarial` asks of a discriminator."""

    def __init__(self, net: LogitNet, rng: torch.Generator) -> None:
        self.net, self.rng = net, rng
        self.optimizer = torch.optim.Adam(net.parameters(), lr=1e-3)

    def logits(self, batch: Transitions) -> Float[Tensor, "B"]:
        return self.net(batch)

    def reward(self, batch: Transitions) -> Float[Tensor, "B"]:
        with torch.no_grad():
            return 1.0 - 0.25 * (self.net(batch) - 1.0).square()

    def update(self, expert: Transitions, policy: Transitions) -> Metrics:
        loss = (self.logits(expert) - 1.0).square().mean() + (self.logits(policy) + 1.0).square().mean()
        x = between(self.net.inputs(expert), self.net.inputs(policy), self.rng)
        penalty = slope_penalty(input_gradient(self.net, x), center=0.0)
        self.optimizer.zero_grad()
        (loss + penalty).backward()
        self.optimizer.step()
        return {"discriminator/loss": loss.item(), "discriminator/gradient_penalty": penalty.item()}

    def state_dict(self) -> dict[str, Any]:
        return {"net": self.net.state_dict(), "optimizer": self.optimizer.state_dict()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self.net.load_state_dict(state["net"])
        self.optimizer.load_state_dict(state["optimizer"])


def build(env_id: str, expert: Transitions, steps: int, seed: int, config: PPOConfig) -> Adversarial:
    """The method on these demonstrations, with PPO."""
    normaliser: Normaliser = fitted_normaliser(expert.obs)
    spec = LogitSpec(expert.obs.shape[1], expert.action.shape[1])
    net = LogitNet(spec, copy.deepcopy(normaliser), torch_stream(seed, "discriminator weights"))
    discriminator = LeastSquares(net, torch_stream(seed, "discriminator"))
    seeds = episode_seeds(seed, "training", config.n_envs)
    learner = PPOLearner(env_id, seeds, config, seed=seed, total_steps=steps, normaliser=normaliser)
    return Adversarial(learner, discriminator, expert, ScheduleConfig(), torch_stream(seed, "minibatches"))


def main(demos: tyro.conf.Positional[str], env_id: str, steps: int = 245_760, seed: int = 0) -> None:
    """Train, and print what each round came to."""
    expert = from_episodes(load_demos(demos, episodes=4, seed=seed).episodes)
    algorithm = build(env_id, expert, steps, seed, PPOConfig())
    for round_ in algorithm.rounds(steps):
        finished = [value for value, _ in algorithm.learner.take_finished()]
        mean = sum(finished) / len(finished) if finished else float("nan")
        print(f"{round_.env_steps} steps: return {mean:.1f}, loss {round_.metrics['discriminator/loss']:.2f}")
    algorithm.learner.close()


if __name__ == "__main__":
    tyro.cli(main)
