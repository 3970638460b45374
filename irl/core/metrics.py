"""Every number a run records, declared once: its meaning and its unit.

A run folder refuses a name that is not here, so a curve is never without an explanation.
"""

from collections.abc import Mapping

Row = Mapping[str, int | float | None]
"""The numbers of one round by declared name; None where there is none yet."""

DECLARED: dict[str, tuple[str, str]] = {
    "round": ("rounds of the loop, counted from 1", "rounds"),
    "env_steps": (
        "environment steps taken so far, over all environments; of `irl train bc`, which takes none, its "
        "gradient steps",
        "steps",
    ),
    "wall_s": ("time since the run began, pauses between resumes left out", "s"),
    "checkpoint_s": ("time spent writing checkpoints since the start of the run", "s"),
    "return_mean": ("mean return of the last 20 training episodes, the environment's own reward", "reward"),
    "length_mean": ("mean length of the last 20 training episodes", "steps"),
    "eval_return_mean": ("mean return of the deterministic policy in its own episodes", "reward"),
    "eval_return_stderr": ("its standard error over those episodes; 0 of a single one", "reward"),
    "eval_length_mean": ("mean length of those episodes", "steps"),
    "eval_learned_return_mean": (
        "mean over the same episodes of the sum of the learned reward, counted from what s_abs pays",
        "reward",
    ),
    "reward/mean": ("mean of the reward given to the learner, before scaling", "reward"),
    "reward/std": ("its standard deviation over the rollout", "reward"),
    "reward/scale": (
        "running standard deviation of its discounted return, which it is divided by; 1 where it is not",
        "reward",
    ),
    "discriminator/loss": (
        "cross-entropy on both classes, or the loss that was chosen, mean over the round; log 4 is blind",
        "nats",
    ),
    "discriminator/gradient_penalty": ("penalty before its weight, mean over the round", "1"),
    "discriminator/accuracy_expert": ("share of demonstration steps called expert, at the round's end", "1"),
    "discriminator/accuracy_policy": ("share of this rollout's steps called policy, at the round's end", "1"),
    "discriminator/logit_expert": ("mean logit of the demonstrations, at the round's end", "nats"),
    "discriminator/logit_policy": ("mean logit of this rollout, at the round's end", "nats"),
    "airl/log_pi_expert": (
        "mean log density of the demonstrations' actions under the policy, bounded, mean over the round",
        "nats",
    ),
    "airl/log_pi_policy": (
        "mean log density of the policy's own actions, earlier rollouts' too, bounded, mean over the round",
        "nats",
    ),
    "airl/log_pi_at_bound": ("share of those densities that the bound cut, mean over the round", "1"),
    "bc/log_pi": ("mean log density of the demonstrations' actions, mean over the round", "nats"),
    "bc/log_pi_held_out": ("the same of demonstrations held out, at the round's end", "nats"),
    "ppo/approx_kl": ("divergence of the old policy from the new one, mean over the last pass", "nats"),
    "ppo/clip_fraction": ("share of probability ratios beyond the clip range", "1"),
    "ppo/policy_loss": ("minus the clipped surrogate, mean over all passes", "advantage"),
    "ppo/value_loss": ("squared error of the value, scaled reward", "1"),
    "ppo/explained_variance": ("share of the return's variance that the value explains", "1"),
    "sac/actor_loss": ("the actor's loss at the round's last update", "scaled return"),
    "sac/critic_loss": ("the critics' loss at the round's last update", "squared return"),
    "sac/ent_coef": ("temperature of the entropy bonus at the round's last update", "reward"),
    "td3/actor_loss": ("the actor's loss, the round's last time that it was improved", "scaled return"),
    "td3/critic_loss": ("the critics' loss at that update", "squared return"),
    "ppo/std": ("standard deviation of the actions, mean over their dimensions", "action"),
}
