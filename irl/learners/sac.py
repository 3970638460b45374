"""Soft actor-critic (Haarnoja et al. 2018, arXiv:1812.05905) on a reward decided as a batch is drawn.

    y    = r(s, a, s') + gamma (1 - terminated) (min_i Q_i'(s', a') - alpha log pi(a'|s'))
    L_Q  = E[(Q_i(s, a) - y)^2],   L_pi = E[alpha log pi(a|s) - min_i Q_i(s, a)]

Stable-Baselines3 does the steps and the updates, one update a step, interleaved in `collect`. Its replay
buffer asks a `RewardFn` at the moment it is sampled, so no stored reward can go stale; a time limit is
no termination.

Differs from the paper: observations are clipped at +-10 standard deviations, as `Policy` does; the
exported policy may be a moving average of the weights.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
import torch
from gymnasium.spaces import Box
from stable_baselines3 import SAC
from stable_baselines3.common.logger import Logger
from stable_baselines3.sac.policies import Actor
from torch import Tensor, nn

from irl.core.config import check_at_least
from irl.core.nets import Normaliser
from irl.core.types import Metrics, RewardFn, Transitions
from irl.learners.averaging import WeightAverage
from irl.learners.features import NormalisedFeatures
from irl.learners.random_state import read_global, write_global
from irl.learners.replay import RewardedReplay
from irl.learners.schedule import learning_rate
from irl.learners.vec import RecordingVecEnv
from irl.policies.policy import Policy, PolicySpec


@dataclass(frozen=True)
class SACConfig:
    """How the policy is improved."""

    KIND: ClassVar[str] = "sac"
    steps_per_round: int = 1000
    """Environment steps between two reports, with one update each."""
    learning_starts: int = 5000
    """Steps of uniformly random actions before the first update."""
    batch_size: int = 256
    """Transitions of one update."""
    buffer_size: int = 1_000_000
    """Transitions kept."""
    lr: float = 3e-4
    """Adam step size of actor, critics and temperature."""
    lr_schedule: Literal["constant", "linear"] = "constant"
    """`constant`, or `linear` from `lr` to 0 over the run."""
    gamma: float = 0.99
    """Discount per environment step."""
    tau: float = 0.005
    """How far the target critics follow at each update."""
    hidden: tuple[int, ...] = (256, 256)
    """Width of each hidden layer of actor and critics, ReLU between."""
    average: float = 0.0
    """Decay a round of the moving average of weights that is exported; 0 exports the newest."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "steps_per_round", "batch_size", "buffer_size")
        check_at_least(self, 0, "learning_starts", "lr", "tau")
        for name in ("gamma", "average"):
            if not 0.0 <= (value := getattr(self, name)) < 1.0:
                raise ValueError(f"{name} must be in [0, 1), not {value}")


class SACLearner:
    """Steps one environment and updates after each step.

    For `learning_starts` steps actions are random and nothing is learned.
    SB3 draws from the global numpy and torch generators, seeded here.
    """

    def __init__(
        self,
        env_id: str,
        env_seeds: list[int],
        config: SACConfig,
        *,
        seed: int,
        total_steps: int,
        normaliser: Normaliser | None = None,
        device: str = "cpu",
    ) -> None:
        """`normaliser` is kept as it is; without one, observations are only clipped."""
        self.config, self.env_id = config, env_id
        self.venv = RecordingVecEnv(env_id, env_seeds[:1])
        assert self.venv.observation_space.shape is not None
        self._normaliser = normaliser or Normaliser(self.venv.observation_space.shape[0])
        self.model = SAC(
            "MlpPolicy",
            self.venv,
            learning_rate=learning_rate(config.lr, config.lr_schedule),
            buffer_size=min(config.buffer_size, total_steps + config.steps_per_round),
            learning_starts=config.learning_starts,
            batch_size=config.batch_size,
            tau=config.tau,
            gamma=config.gamma,
            replay_buffer_class=RewardedReplay,
            policy_kwargs={
                "net_arch": list(config.hidden),
                "features_extractor_class": NormalisedFeatures,
                "features_extractor_kwargs": {"normaliser": self._normaliser},
            },
            seed=seed,
            device=device,
        )
        self.model.set_logger(Logger(folder=None, output_formats=[]))
        self._average = WeightAverage(_actor_weights(self.model.actor), config.average)
        _, self._callback = self.model._setup_learn(total_steps, callback=None)

    @property
    def env_steps(self) -> int:
        """Environment steps taken so far."""
        return self.model.num_timesteps

    @property
    def reward_scale(self) -> float:
        """Rewards reach SAC as they are."""
        return 1.0

    @property
    def _replay(self) -> RewardedReplay:
        assert isinstance(self.model.replay_buffer, RewardedReplay)
        return self.model.replay_buffer

    def take_finished(self) -> list[tuple[float, int]]:
        """Return (the environment's own) and length of each episode that ended since the last call."""
        return self.venv.take_finished()

    def start(self, reward: RewardFn) -> None:
        """Name the reward that every sampled batch is given."""
        self._replay.reward = reward

    def collect(self) -> Transitions:
        """The steps of one round; each is followed by an update once the random ones are over."""
        model, config = self.model, self.config
        for _ in range(config.steps_per_round):
            model.collect_rollouts(
                self.venv,
                self._callback,
                model.train_freq,  # pyright: ignore[reportArgumentType]
                self._replay,
                learning_starts=config.learning_starts,
            )
            if model.num_timesteps > config.learning_starts:
                model.train(gradient_steps=1, batch_size=config.batch_size)
        self._average.update(_actor_weights(model.actor))
        return self.venv.take().to(model.device)

    def improve(self, reward: RewardFn) -> Metrics:
        """Name the reward of the next rounds; what the last updates were like."""
        self._replay.reward = reward
        logged = self.model.logger.name_to_value
        names = [name for name in ("actor_loss", "critic_loss", "ent_coef") if f"train/{name}" in logged]
        metrics = {f"sac/{name}": float(logged[f"train/{name}"]) for name in names}
        logged.clear()
        return metrics

    def policy(self) -> Policy:
        """The current policy, exported: a copy that later updates leave alone."""
        box = self.venv.action_space
        assert isinstance(box, Box)
        weights = {name: weight.numpy().copy() for name, weight in self._average.weights.items()}
        mean, std = self._normaliser.mean, self._normaliser.std
        weights |= {"obs_mean": mean.cpu().numpy().copy(), "obs_std": std.cpu().numpy().copy()}
        weights |= {"action_low": box.low, "action_high": box.high}
        sizes = (len(mean), len(box.low))
        return Policy(
            PolicySpec(self.env_id, *sizes, self.config.hidden, "relu", "squashed_gaussian"), weights
        )

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        model = self.model
        assert model.ent_coef_optimizer is not None
        return {
            "policy": model.policy.state_dict(),
            "optimizers": [optimizer.state_dict() for optimizer in self._optimizers()],
            "log_ent_coef": model.log_ent_coef,
            "steps": (model.num_timesteps, model._n_updates, model._episode_num),
            "last_obs": model._last_obs,
            "replay": self._replay.state_dict(),
            "average": self._average.state_dict(),
            "environments": self.venv.state_dict(),
            "global_random": read_global(),
            "action_space": dict(self.venv.action_space.np_random.bit_generator.state),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another learner of the same settings was; `start` names the reward."""
        model = self.model
        model.policy.load_state_dict(state["policy"])
        for optimizer, its in zip(self._optimizers(), state["optimizers"], strict=True):
            optimizer.load_state_dict(its)
        with torch.no_grad():
            assert isinstance(model.log_ent_coef, Tensor)
            model.log_ent_coef.copy_(state["log_ent_coef"])
        model.num_timesteps, model._n_updates, model._episode_num = state["steps"]
        model._last_obs = state["last_obs"]
        self._replay.load_state_dict(state["replay"])
        self._average.load_state_dict(state["average"])
        self.venv.load_state_dict(state["environments"])
        assert isinstance(model._last_obs, np.ndarray)
        self.venv.resume_from(model._last_obs)
        write_global(state["global_random"])
        self.venv.action_space.np_random.bit_generator.state = state["action_space"]

    def _optimizers(self) -> list[torch.optim.Optimizer]:
        model = self.model
        assert model.ent_coef_optimizer is not None
        return [model.actor.optimizer, model.critic.optimizer, model.ent_coef_optimizer]

    def close(self) -> None:
        """Close the environment."""
        self.venv.close()


def _actor_weights(actor: Actor) -> dict[str, Tensor]:
    """The weights that make the policy act, under the names that `Policy` has for them."""
    layers = [m for m in actor.latent_pi if isinstance(m, nn.Linear)]
    assert isinstance(actor.mu, nn.Linear)
    assert isinstance(actor.log_std, nn.Linear)
    weights: dict[str, Tensor] = {}
    for i, layer in enumerate([*layers, actor.mu]):
        weights |= {f"layers.{i}.weight": layer.weight, f"layers.{i}.bias": layer.bias}
    weights |= {"log_std.weight": actor.log_std.weight, "log_std.bias": actor.log_std.bias}
    return {name: weight.detach().cpu() for name, weight in weights.items()}
