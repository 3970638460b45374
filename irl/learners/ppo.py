"""Proximal policy optimisation (Schulman et al. 2017, arXiv:1707.06347) on a reward given afterwards.

    A_t = sum_l (gamma lambda)^l delta_{t+l},  delta_t = r'_t + gamma V(s_{t+1}) - V(s_t)
    r'_t = r_t / std(G) + [truncated at t] gamma V(s_{t+1})
    L    = E[min(rho A, clip(rho, 1-eps, 1+eps) A)] - c_v (V - R)^2 + c_e H

The model is Stable-Baselines3's; rollouts (`ppo_collect`) and gradient steps (`ppo_update`) are its own
within rounding, and faster. Between the two its rollout buffer is given the reward of a `RewardFn`, the value
of the observation that a time limit cut off is added on that reward, and the advantages are computed.

Differs from the paper: observations are normalised inside the policy; rewards are scaled by the running
standard deviation of their discounted return; the exported policy may be a moving average of the weights,
w' <- c w' + (1 - c) w after each round (Polyak & Juditsky 1992 average iterates; here with a window).
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Literal

from gymnasium.spaces import Box, Discrete
from stable_baselines3 import PPO
from stable_baselines3.common.logger import Logger
from torch import Tensor, nn

from irl.core.config import check_at_least, check_widths
from irl.core.finite import check_finite, named
from irl.core.nets import ACTIVATIONS, Normaliser
from irl.core.schedule import learning_rate, rate_at
from irl.core.types import Metrics, RewardFn
from irl.envs.discrete import OneHot
from irl.learners.adopting import adopt
from irl.learners.averaging import WeightAverage
from irl.learners.features import NormalisedFeatures
from irl.learners.ppo_choices import SB3Update
from irl.learners.ppo_collect import collect
from irl.learners.ppo_rollout import Rollouts, by_sb3
from irl.learners.ppo_update import PPOUpdate
from irl.learners.random_state import read_global, write_global
from irl.learners.vec import RecordingVecEnv
from irl.policies.policy import Policy, PolicySpec
from irl.rewards.normalise import ReturnScale


@dataclass(frozen=True)
class PPOConfig:
    """How the policy is improved: the keywords of SB3's PPO.

    `learning_rate` is `lr` with its schedule, `n_steps` is `steps_per_round` / `n_envs`, `policy_kwargs` are
    `hidden` and `log_std_init`. There is no `use_sde`: an exported policy has no such noise.
    """

    KIND: ClassVar[str] = "ppo"
    ADDED: ClassVar[dict[str, Any]] = {
        "clip_range_vf": None,
        "normalize_advantage": True,
        "vf_coef": 0.5,
        "max_grad_norm": 0.5,
        "target_kl": None,
        "activation": "tanh",
        "reward_scaling": "std",
        "reward_clip": 0.0,
        "ent_schedule": "constant",
    }
    n_envs: int = 16
    """Environments stepped side by side."""
    steps_per_round: int = 2048
    """Environment steps of one rollout, over all environments."""
    batch_size: int = 512
    """Transitions of one gradient step."""
    n_epochs: int = 20
    """Passes over each rollout."""
    lr: float = 6e-4
    """Adam step size."""
    lr_schedule: Literal["constant", "linear"] = "linear"
    """`constant`, or `linear` from `lr` to 0 over the run: by what remains once a rollout is played, as in
    SB3, so that the passes over the last one are at 0."""
    gamma: float = 0.99
    """Discount per environment step."""
    gae_lambda: float = 0.97
    """Weight of longer advantage estimates."""
    clip_range: float = 0.2
    """How far a probability ratio may move."""
    clip_range_vf: float | None = None
    """How far the value may move in an update; None leaves it free."""
    normalize_advantage: bool = True
    """Advantages of a minibatch at mean 0 and deviation 1."""
    ent_coef: float = 0.0
    """Weight of the entropy bonus."""
    ent_schedule: Literal["constant", "linear"] = "constant"
    """`constant`, or `linear` from `ent_coef` to 0 over the run: a bonus that stays may make actions so wide
    that their mean, which the exported policy takes where it is deterministic, is hardly tried."""
    vf_coef: float = 0.5
    """Weight of the value's loss."""
    max_grad_norm: float = 0.5
    """Longest gradient; a longer one is shortened to it."""
    target_kl: float | None = None
    """Passes stop once the policy is 1.5 times this far from where it was; None never stops them."""
    hidden: tuple[int, ...] = (64, 64)
    """Width of each hidden layer of policy and value."""
    activation: Literal["tanh", "relu"] = "tanh"
    """Between those layers."""
    log_std_init: float = -0.5
    """Logarithm of the first standard deviation of the actions."""
    reward_scaling: Literal["std", "none"] = "std"
    """What rewards are divided by: the running deviation of their discounted return, or nothing."""
    reward_clip: float = 0.0
    """Bound of a reward after that; 0: none. What is saved is the reward before both."""
    average: float = 0.0
    """Decay a round of the moving average of weights that is exported; 0 exports the newest."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "n_envs", "steps_per_round", "batch_size", "n_epochs")
        check_at_least(self, 0, "lr", "clip_range", "vf_coef", "reward_clip")
        check_widths(self, "hidden")
        if self.normalize_advantage and self.batch_size < 2:
            raise ValueError("batch_size must be at least 2: one advantage has no deviation to be divided by")
        if self.max_grad_norm <= 0.0:
            # 0 would clip every gradient away
            raise ValueError(f"max_grad_norm must be above 0, not {self.max_grad_norm}")
        if not 0.0 <= self.gae_lambda <= 1.0:
            raise ValueError(f"gae_lambda must be in [0, 1], not {self.gae_lambda}")
        for name in ("clip_range_vf", "target_kl"):
            if (value := getattr(self, name)) is not None and value <= 0.0:
                raise ValueError(f"{name} must be above 0, or None, not {value}")
        if self.steps_per_round % self.n_envs or self.steps_per_round % self.batch_size:
            raise ValueError(
                f"steps_per_round ({self.steps_per_round}) must be a multiple of n_envs ({self.n_envs}) "
                f"and of batch_size ({self.batch_size})"
            )
        for name in ("gamma", "average"):
            if not 0.0 <= (value := getattr(self, name)) < 1.0:
                raise ValueError(f"{name} must be in [0, 1), not {value}")


class PPOLearner(Rollouts):
    """Collects rollouts, is told their reward, and improves the policy.

    SB3 draws actions and minibatches from the global numpy and torch generators, seeded here; whoever
    runs beside it must leave them alone.
    """

    def __init__(
        self,
        env_id: str,
        env_seeds: list[int],
        config: PPOConfig,
        *,
        seed: int,
        total_steps: int,
        normaliser: Normaliser | None = None,
        env_kwargs: dict[str, Any] | None = None,
        device: str = "cpu",
    ) -> None:
        """`normaliser` is kept as it is; without one, a running normaliser follows the rollouts."""
        self.config, self.env_id, self.total_steps = config, env_id, total_steps
        self.venv = RecordingVecEnv(env_id, env_seeds, env_kwargs)
        self._running = normaliser is None
        scaled = config.reward_scaling == "std"
        self._scale = ReturnScale(config.n_envs, config.gamma, scaled=scaled, clip=config.reward_clip)
        self.model = PPO(
            "MlpPolicy",
            self.venv,
            learning_rate=learning_rate(config.lr, config.lr_schedule),
            n_steps=config.steps_per_round // config.n_envs,
            batch_size=config.batch_size,
            n_epochs=config.n_epochs,
            gamma=config.gamma,
            gae_lambda=config.gae_lambda,
            clip_range=config.clip_range,
            clip_range_vf=config.clip_range_vf,
            normalize_advantage=config.normalize_advantage,
            ent_coef=config.ent_coef,
            vf_coef=config.vf_coef,
            max_grad_norm=config.max_grad_norm,
            target_kl=config.target_kl,
            policy_kwargs={
                "net_arch": list(config.hidden),
                "activation_fn": ACTIVATIONS[config.activation],
                "log_std_init": config.log_std_init,
                "features_extractor_class": NormalisedFeatures,
                "features_extractor_kwargs": {"normaliser": normaliser},
            },
            seed=seed,
            device=device,
        )
        _centre(self.model)
        # without one SB3 makes a folder for its own
        self.model.set_logger(Logger(folder=None, output_formats=[]))
        chosen = isinstance(self.model.action_space, Discrete)
        self._update = SB3Update(self.model) if chosen else PPOUpdate(self.model, config.activation)
        self._average = WeightAverage(_actor_weights(self.model), config.average)
        _, callback = self.model._setup_learn(total_steps, callback=None)
        gaussian = partial(collect, self.model, self.venv, config.activation)
        self._fill = by_sb3(self.model, self.venv, callback) if chosen else gaussian

    @property
    def _normaliser(self) -> Normaliser:
        extractor = self.model.policy.features_extractor
        assert isinstance(extractor, NormalisedFeatures)
        return extractor.normaliser

    def improve(self, reward: RewardFn) -> Metrics:
        """Reward the last rollout in one batch and do PPO's gradient steps on it.

        Raises:
            RuntimeError: nothing was collected since the last call.
            NotFinite: the reward, or a weight after the steps, is NaN or infinite.
        """
        batch, rewards = self.rewarded(reward)
        metrics = self._train()
        self._average.update(_actor_weights(self.model))
        if self._running:
            # after the gradient steps: within a round, old and new log pi see one normaliser
            self._normaliser.update(batch.obs)
        return metrics | rewards

    def _train(self) -> Metrics:
        model = self.model
        # the schedules of rate and clipping follow what remains of the run
        model._update_current_progress_remaining(self.env_steps, self.total_steps)
        remaining = model._current_progress_remaining
        c = self.config
        model.ent_coef = rate_at(c.ent_coef, c.ent_schedule, remaining)
        metrics = self._update(model.lr_schedule(remaining), c.clip_range, c.clip_range_vf)
        check_finite(named("policy", model.policy.state_dict()))
        return metrics

    def policy(self) -> Policy:
        """The current policy, exported: a copy that later updates leave alone."""
        # the environments' own: rows where SB3 sees choices
        normaliser, box = self._normaliser, self.venv.venv.action_space
        assert isinstance(box, Box)
        weights = {name: weight.numpy().copy() for name, weight in self._average.weights.items()}
        weights |= {"obs_mean": normaliser.mean.cpu().numpy().copy(), "obs_std": normaliser.std.cpu().numpy()}
        weights |= {"action_low": box.low, "action_high": box.high}
        sizes = (len(normaliser.mean), len(box.low))
        kind = "categorical" if isinstance(box, OneHot) else "gaussian"
        spec = PolicySpec(self.env_id, *sizes, self.config.hidden, self.config.activation, kind)
        return Policy(spec, weights)

    def adopt(self, policy: Policy) -> None:
        """Act as `policy` does from now on.

        Raises:
            ValueError: its layers are of other sizes.
        """
        adopt(_acting(self.model), policy)
        self._average = WeightAverage(_actor_weights(self.model), self.config.average)

    def state_dict(self) -> dict[str, Any]:
        """Everything needed to go on, between two rounds."""
        model = self.model
        return {
            "policy": model.policy.state_dict(),
            "optimizer": self._update.optimizer.state_dict(),
            "steps": model.num_timesteps,
            "updates": model._n_updates,
            "last_obs": model._last_obs,
            "last_starts": model._last_episode_starts,
            "scale": self._scale.state_dict(),
            "average": self._average.state_dict(),
            "environments": self.venv.state_dict(),
            "global_random": read_global(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another learner of the same settings was.

        Raises:
            UserError: the task draws from a generator of its own, so its place cannot be found again.
        """
        model = self.model
        model.policy.load_state_dict(state["policy"])
        self._update.optimizer.load_state_dict(state["optimizer"])
        model.num_timesteps, model._n_updates = state["steps"], state["updates"]
        model._last_obs, model._last_episode_starts = state["last_obs"], state["last_starts"]
        self._scale.load_state_dict(state["scale"])
        self._average.load_state_dict(state["average"])
        self.venv.load_state_dict(state["environments"], state["last_obs"])
        write_global(state["global_random"])

    def close(self) -> None:
        """Close the environments."""
        self.venv.close()


def _centre(model: PPO) -> None:
    """Begin at the middle of the box of actions, as SB3 does where that is 0.

    From far outside, every action that is drawn would be clipped to one bound, and nothing learned from it.
    """
    if isinstance(box := model.action_space, Box):
        bias = model.policy.action_net.bias
        assert isinstance(bias, nn.Parameter)
        bias.data += bias.new_tensor((box.low + box.high) / 2)


def _actor_weights(model: PPO) -> dict[str, Tensor]:
    return {name: weight.cpu() for name, weight in _acting(model).items()}


def _acting(model: PPO) -> dict[str, Tensor]:
    """The weights that make the policy act, under the names that `Policy` has for them."""
    net = model.policy
    layers = [m for m in net.mlp_extractor.policy_net if isinstance(m, nn.Linear)]
    assert isinstance(net.action_net, nn.Linear)
    weights: dict[str, Tensor] = {"log_std": net.log_std} if isinstance(model.action_space, Box) else {}
    for i, layer in enumerate([*layers, net.action_net]):
        weights |= {f"layers.{i}.weight": layer.weight, f"layers.{i}.bias": layer.bias}
    return {name: weight.detach() for name, weight in weights.items()}
