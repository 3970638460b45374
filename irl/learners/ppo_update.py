"""The gradient steps of Stable-Baselines3's PPO, faster than its own `train`.

From the same rollout and the same order of its steps the weights are those of `PPO.train` within rounding;
a test holds it. What makes it faster: gradients are written out, observations are normalised once a
rollout, and Adam is fused.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from torch import Tensor, nn

from irl.core.finite import NotFinite, check_finite, named
from irl.core.flat import flattened, linear_layers
from irl.core.types import Metrics
from irl.learners import ppo_losses as losses
from irl.learners.stack import Stack


@dataclass(frozen=True)
class Rollout:
    """What a gradient step is taken on: rows of a rollout, on the learner's device."""

    features: Float[Tensor, "B F"]
    action: Float[Tensor, "B A"]
    log_pi: Float[Tensor, "B"]
    value: Float[Tensor, "B"]
    advantage: Float[Tensor, "B"]
    returns: Float[Tensor, "B"]

    def __len__(self) -> int:
        return len(self.value)

    def __getitem__(self, rows: Tensor) -> "Rollout":
        return Rollout(**{name: column[rows] for name, column in vars(self).items()})


class PPOUpdate:
    """The networks of an SB3 PPO with Gaussian actions, their optimiser, and the steps that change them."""

    def __init__(self, model: PPO, activation: str) -> None:
        """`activation` is that between the model's hidden layers: tanh or relu."""
        self.model = model
        policy, nets = model.policy, model.policy.mlp_extractor
        assert isinstance(policy.action_net, nn.Linear)
        assert isinstance(policy.log_std, nn.Parameter)
        self._actor = Stack([linear_layers(nets.policy_net)], [[policy.action_net]], activation)
        self._value = Stack([linear_layers(nets.value_net)], [[policy.value_net]], activation)
        self._log_std = flattened([policy.log_std])
        self._log_std.grad = torch.zeros_like(self._log_std)
        self._trained = (self._actor.flat, self._value.flat, self._log_std)
        # SB3's epsilon, not torch's
        self.optimizer = torch.optim.Adam(self._trained, eps=1e-5, fused=True)

    @torch.no_grad()
    def __call__(self, lr: float, clip_range: float, clip_range_vf: float | None) -> Metrics:
        """Every pass over the model's rollout buffer; the order of its steps is numpy's global one, as SB3's.

        Returns what SB3 logs: means over the steps of the last pass but for `explained_variance` and `std`.
        """
        self.optimizer.param_groups[0]["lr"] = lr
        rollout, seen = self._rollout(self.model.rollout_buffer), []
        kls: list[Tensor] = []
        for _ in range(self.model.n_epochs):
            # SB3 draws it here too, and a resumed run draws the same
            order = torch.from_numpy(np.random.permutation(len(rollout)))
            kls, stop = [], False
            for rows in order.to(rollout.value.device).split(self.model.batch_size):
                metrics, stop = self._step(rollout[rows], clip_range, clip_range_vf)
                kls.append(metrics.pop("approx_kl"))
                seen.append(metrics)
                if stop:
                    break
            self.model._n_updates += 1
            if stop:
                break
        means = {f"ppo/{name}": sum(float(row[name]) for row in seen) / len(seen) for name in seen[0]}
        means["ppo/approx_kl"] = float(torch.stack(kls).mean())
        unexplained = (rollout.returns - rollout.value).var() / rollout.returns.var()
        means["ppo/explained_variance"] = float(1.0 - unexplained)
        return means | {"ppo/std": float(self._log_std.exp().mean())}

    def _step(self, rows: Rollout, clip: float, clip_vf: float | None) -> tuple[dict[str, Tensor], bool]:
        """One gradient step; whether the policy is too far from where it was, in which case there is none."""
        model, size = self.model, len(rows)
        mean, seen = self._actor(rows.features)
        value, value_seen = self._value(rows.features)
        std = self._log_std.exp()
        z = (rows.action - mean[0]) / std
        log_ratio = losses.log_density(z, self._log_std) - rows.log_pi
        advantage = rows.advantage
        if model.normalize_advantage and size > 1:
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        ratio = log_ratio.exp()
        gain, of_log_pi = losses.surrogate(advantage, ratio, clip)
        error, of_value = losses.value_error(value[0, :, 0], rows.value, rows.returns, clip_vf)
        kl = losses.approximate_kl(log_ratio)
        metrics = {
            "approx_kl": kl,
            "clip_fraction": ((ratio - 1.0).abs() > clip).float().mean(),
            "value_loss": error.mean(),
            "policy_loss": -gain.mean(),
        }
        if model.target_kl is not None and float(kl) > 1.5 * model.target_kl:
            return metrics, True
        # L = -E[gain] + c_v E[error] - c_e H, and d log pi / d mean = z / std, d log pi / d log_std = z^2 - 1
        of_log_pi = (of_log_pi / -size).unsqueeze(1)
        self._actor.differentiate((of_log_pi * z / std).unsqueeze(0), seen)
        self._value.differentiate((of_value * (model.vf_coef / size)).view(1, -1, 1), value_seen)
        torch.sum(of_log_pi * (z.square() - 1.0), 0, out=self._log_std.grad)
        assert self._log_std.grad is not None
        self._log_std.grad -= model.ent_coef
        nn.utils.clip_grad_norm_(self._trained, model.max_grad_norm, foreach=True)
        self.optimizer.step()
        return metrics, False

    def _rollout(self, buffer: RolloutBuffer) -> Rollout:
        """The buffer's rows, environment by environment, with normalised observations."""

        def column(values: np.ndarray) -> Tensor:
            rows = np.ascontiguousarray(values.swapaxes(0, 1)).reshape(-1, *values.shape[2:])
            return torch.from_numpy(rows).to(self.model.device, torch.float32)

        return Rollout(
            features=self.model.policy.features_extractor(column(buffer.observations)),
            action=column(buffer.actions),
            log_pi=column(buffer.log_probs),
            value=column(buffer.values),
            advantage=column(buffer.advantages),
            returns=column(buffer.returns),
        )


class SB3Update:
    """SB3's own steps, for a choice of actions."""

    def __init__(self, model: PPO) -> None:
        self.model, self.optimizer = model, model.policy.optimizer

    def __call__(self, lr: float, clip_range: float, clip_range_vf: float | None) -> Metrics:
        """Every pass over the model's rollout buffer, at the model's own settings, which these are.

        Raises:
            NotFinite: the policy's logits are not numbers.
        """
        before = self.model.policy.state_dict()
        try:
            self.model.train()
        except ValueError as error:
            # torch's distributions refuse logits that are not finite; the weights may still be, and be huge
            check_finite(named("policy", before))
            if "constraint" in str(error):
                raise NotFinite("policy's logits of the actions") from error
            raise
        logged = self.model.logger.name_to_value
        names = ("approx_kl", "clip_fraction", "value_loss", "explained_variance")
        metrics = {f"ppo/{name}": float(logged[f"train/{name}"]) for name in names}
        logged.clear()
        return metrics
