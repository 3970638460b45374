"""The gradient steps of a PPO that chooses among actions: Stable-Baselines3's own."""

from stable_baselines3 import PPO

from irl.core.finite import NotFinite, check_finite, named
from irl.core.types import Metrics


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
