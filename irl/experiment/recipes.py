"""How each expert was made: settings by task and algorithm, as data."""

import dataclasses
from dataclasses import dataclass

from irl.core import products
from irl.learners.ppo import PPOConfig
from irl.learners.sac import SACConfig


@dataclass(frozen=True)
class Recipe:
    """An algorithm's settings and how long it runs."""

    steps: int
    learner: PPOConfig | SACConfig


# The newest weights fall over in two of five episodes at one evaluation and in none at the next; their
# average over some 100k steps does not flicker so.
_PPO = PPOConfig(n_envs=8, batch_size=256, n_epochs=10, lr=3e-4, gae_lambda=0.95, average=0.98)

# Left alone, or with a bonus of .01 or .02, half of the seeds or more end with a gait that runs faster than
# it can stand (1800 to 2700, episodes of 500 steps); with .03 one of four did.
_HOPPER = dataclasses.replace(_PPO, n_envs=16, batch_size=512, ent_coef=0.03)

_SAC = SACConfig(lr_schedule="linear", average=0.98)

# Truncated quantile critics: SAC itself stands still between 6,000 and 7,000 from 200k steps on.
_CHEETAH = SACConfig(
    n_envs=2,
    updates_per_step=0.5,
    learning_starts=10_000,
    quantiles=25,
    lr=6e-4,
    lr_schedule="linear",
    products=products.fastest(),
    average=0.98,
)

# Left alone the actions' deviation falls to .06 by 6M steps, and a gait that was never disturbed falls over
# in a third of the episodes; the entropy bonus keeps it disturbed.
_WALKER = dataclasses.replace(_PPO, n_envs=16, steps_per_round=4096, batch_size=512, ent_coef=0.003)

# What counts is where the arm is some steps from now; at first it may not wave it about.
_REACHER = dataclasses.replace(_PPO, gamma=0.9, log_std_init=-1.0)
_PUSHER = dataclasses.replace(_REACHER, gamma=0.98)

# A stroke pays off long after it. Rounds of 256 steps an environment at 3e-4 stood still at 140.
_SWIMMER = dataclasses.replace(
    _PPO, n_envs=4, steps_per_round=4096, lr=6e-4, gamma=0.9999, gae_lambda=0.98, log_std_init=0.0
)
_ANT = dataclasses.replace(_PPO, n_envs=16, steps_per_round=4096, batch_size=512, hidden=(128, 128))

# Its actions are bounded at .4: a first deviation of .6 is mostly clipped, and with seventeen of them 3e-4
# moves the policy so far in a round (a divergence of .1) that it stands still at 460.
_HUMANOID = dataclasses.replace(
    _ANT, n_epochs=6, hidden=(256, 128), log_std_init=-1.3, lr=1e-4, target_kl=0.03
)

# PPO's fell at once in two to four of 20 episodes: an old hand begins few of them, and forgets how. SAC's
# memory does not.
_DOUBLE = SACConfig(learning_starts=2000, lr_schedule="linear", average=0.8)

# A short run's average is mostly of its beginning.
_NEWEST = dataclasses.replace(_PPO, average=0.0)

DEFAULTS: dict[str, Recipe] = {"ppo": Recipe(1_500_000, _PPO), "sac": Recipe(1_000_000, _SAC)}
"""For a task without a row of its own, by algorithm."""

RECIPES: dict[tuple[str, str], Recipe] = {
    ("Hopper-v5", "ppo"): Recipe(2_000_000, _HOPPER),
    ("HalfCheetah-v5", "sac"): Recipe(1_000_000, _CHEETAH),
    ("Walker2d-v5", "ppo"): Recipe(3_000_000, _WALKER),
    ("InvertedPendulum-v5", "ppo"): Recipe(200_000, _PPO),
    ("Reacher-v5", "ppo"): Recipe(1_000_000, _REACHER),
    ("Pusher-v5", "ppo"): Recipe(1_000_000, _PUSHER),
    ("Swimmer-v5", "ppo"): Recipe(1_000_000, _SWIMMER),
    ("Ant-v5", "ppo"): Recipe(4_000_000, _ANT),
    ("Humanoid-v5", "ppo"): Recipe(3_000_000, _HUMANOID),
    ("InvertedDoublePendulum-v5", "sac"): Recipe(40_000, _DOUBLE),
}
"""By task and algorithm; a row here made a shipped expert."""

MEDIUM: dict[tuple[str, str], Recipe] = {
    ("Hopper-v5", "ppo"): Recipe(350_000, _NEWEST),
    ("HalfCheetah-v5", "ppo"): Recipe(900_000, _NEWEST),
    ("Walker2d-v5", "ppo"): Recipe(560_000, dataclasses.replace(_WALKER, average=0.0)),
}
"""The same for the level `medium`: about a third of the expert's return."""


def recipe(env_id: str, algo: str | None, level: str = "expert") -> tuple[str, Recipe]:
    """An algorithm and its row for this task, or its default; without one, that of the shipped policy.

    A level of another name than `medium` is made as an expert is.
    """
    rows = MEDIUM if level == "medium" else RECIPES
    if algo is None:
        algo = next((of for task, of in rows if task == env_id), "ppo")
    return algo, rows.get((env_id, algo)) or RECIPES.get((env_id, algo), DEFAULTS[algo])
