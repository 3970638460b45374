"""The gradient steps of Stable-Baselines3's PPO, faster than its own `train`.

From the same rollout and the same order of its steps the weights are those of `PPO.train` within rounding;
a test holds it. What makes it faster: gradients are written out, observations are normalised once a
rollout, rows are put in order and advantages normalised once a pass, all gradients lie in one tensor, Adam
is called without its checks, and what is only reported is computed at the end, of all steps at once.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from torch import Tensor, nn

from irl.core import adam
from irl.core.flat import flattened, linear_layers
from irl.core.types import Metrics
from irl.learners import ppo_losses as losses
from irl.learners.ppo_net import Net


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

    def __getitem__(self, rows: Tensor | slice) -> "Rollout":
        return Rollout(**{name: column[rows] for name, column in vars(self).items()})


@dataclass(frozen=True)
class Seen:
    """What is reported of one gradient step."""

    log_ratio: Float[Tensor, "B"]
    gain: Float[Tensor, "B"]
    error: Float[Tensor, "B"]


class PPOUpdate:
    """The networks of an SB3 PPO with Gaussian actions, their optimiser, and the steps that change them."""

    def __init__(self, model: PPO, activation: str) -> None:
        """`activation` is that between the model's hidden layers: tanh or relu."""
        self.model = model
        policy, nets = model.policy, model.policy.mlp_extractor
        assert isinstance(policy.action_net, nn.Linear)
        assert isinstance(policy.log_std, nn.Parameter)
        actor = [*linear_layers(nets.policy_net), policy.action_net]
        value = [*linear_layers(nets.value_net), policy.value_net]
        of_both = [[p for layer in net for p in (layer.weight, layer.bias)] for net in (actor, value)]
        flat = flattened([*of_both[0], *of_both[1], policy.log_std])
        sizes = [sum(p.numel() for p in of_one) for of_one in of_both] + [policy.log_std.numel()]
        self._trained, self._gradient = flat.split(sizes), torch.zeros_like(flat)
        self._gradients = self._gradient.split(sizes)
        for weights, gradient in zip(self._trained, self._gradients, strict=True):
            weights.grad = gradient
        self._actor = Net(actor, activation, self._gradients[0])
        self._value = Net(value, activation, self._gradients[1])
        self._log_std, self._of_log_std = self._trained[2], self._gradients[2]
        # SB3's epsilon, not torch's
        self.optimizer = torch.optim.Adam(self._trained, eps=1e-5, fused=True)

    @torch.no_grad()
    def __call__(self, lr: float, clip_range: float, clip_range_vf: float | None) -> Metrics:
        """Every pass over the model's rollout buffer; the order of its steps is numpy's global one, as SB3's.

        Returns what SB3 logs: means over all steps but for `approx_kl` (the last pass), `explained_variance`
        and `std`.
        """
        self.optimizer.param_groups[0]["lr"] = lr
        rollout, seen = self._rollout(self.model.rollout_buffer), []
        for _ in range(self.model.n_epochs):
            # SB3 draws it here too, and a resumed run draws the same
            order = torch.from_numpy(np.random.permutation(len(rollout)))
            of_pass, stop = [], False
            for rows in self._minibatches(rollout, order.to(rollout.value.device)):
                step, stop = self._step(rows, clip_range, clip_range_vf)
                of_pass.append(step)
                if stop:
                    break
            seen.append(of_pass)
            self.model._n_updates += 1
            if stop:
                break
        unexplained = (rollout.returns - rollout.value).var() / rollout.returns.var()
        return _figures(seen, clip_range) | {
            "ppo/explained_variance": float(1.0 - unexplained),
            "ppo/std": float(self._log_std.exp().mean()),
        }

    def _minibatches(self, rollout: Rollout, order: Tensor) -> list[Rollout]:
        """The rollout in that order, in parts, the advantages of each at mean 0 and deviation 1."""
        size, ordered = self.model.batch_size, rollout[order]
        if self.model.normalize_advantage and size > 1:
            parts = ordered.advantage.view(-1, size)
            deviation, mean = torch.std_mean(parts, 1, keepdim=True)
            ordered = replace(ordered, advantage=((parts - mean) / (deviation + 1e-8)).flatten())
        return [ordered[start : start + size] for start in range(0, len(ordered), size)]

    def _step(self, rows: Rollout, clip: float, clip_vf: float | None) -> tuple[Seen, bool]:
        """One gradient step; whether the policy is too far from where it was, in which case there is none."""
        model, size = self.model, len(rows)
        mean, of_mean = self._actor(rows.features)
        value, value_seen = self._value(rows.features)
        std = self._log_std.exp()
        z = (rows.action - mean) / std
        log_ratio = losses.log_density(z, self._log_std) - rows.log_pi
        gain, of_log_pi = losses.surrogate(rows.advantage, log_ratio.exp(), clip)
        error, of_value = losses.value_error(value[:, 0], rows.value, rows.returns, clip_vf)
        seen = Seen(log_ratio, gain, error)
        if model.target_kl is not None and float(losses.approximate_kl(log_ratio)) > 1.5 * model.target_kl:
            return seen, True
        # L = -E[gain] + c_v E[error] - c_e H, and d log pi / d mean = z / std, d log pi / d log_std = z^2 - 1
        of_log_pi = (of_log_pi / -size).unsqueeze(1)
        self._actor.differentiate(of_log_pi * z / std, of_mean)
        self._value.differentiate((of_value * (model.vf_coef / size)).unsqueeze(1), value_seen)
        torch.sum(of_log_pi * (z.square() - 1.0), 0, out=self._of_log_std)
        self._of_log_std -= model.ent_coef
        self._descend(model.max_grad_norm)
        return seen, False

    def _descend(self, longest: float) -> None:
        """Adam's step along the gradient, shortened to `longest` where it is longer."""
        # torch.nn.utils.clip_grad_norm_ of the whole, without its norm of each part
        length = torch.linalg.vector_norm(self._gradient)
        self._gradient *= (longest / (length + 1e-6)).clamp(max=1.0)
        adam.step(self.optimizer)

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


def _figures(passes: list[list[Seen]], clip: float) -> Metrics:
    """What SB3 logs of the steps of each pass."""

    def column(name: str, of: list[list[Seen]] = passes) -> Tensor:
        return torch.cat([getattr(step, name) for of_pass in of for step in of_pass])

    return {
        "ppo/clip_fraction": float(((column("log_ratio").exp() - 1.0).abs() > clip).float().mean()),
        "ppo/value_loss": float(column("error").mean()),
        "ppo/policy_loss": float(-column("gain").mean()),
        "ppo/approx_kl": float(losses.approximate_kl(column("log_ratio", passes[-1:]))),
    }
