"""Settings of papers and of their code, and of single tasks, as data: `irl train METHOD --preset NAME`.

What irl has not is not imitated: each row says what is another thing here. A setting that a source leaves
open is the method's own.
"""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Preset:
    """One recipe."""

    method: str
    """The `irl train` command that it is of."""
    source: str
    """Where the numbers are from: read there, not remembered."""
    differs: str
    """What is not as there."""
    settings: dict[str, Any]
    """Dotted names and values."""


_SAC = {"learner.quantiles": 0, "learner.average": 0.0, "learner.lr_schedule": "constant"}

_TD3 = {
    "learner.exploration_noise": 0.1,
    "learner.policy_delay": 2,
    "learner.target_policy_noise": 0.2,
    "learner.target_noise_clip": 0.5,
}

_STEADY = {"learner.lr_schedule": "constant", "learner.gamma": 0.98}

_SHORT = _STEADY | {
    "learner.gae_lambda": 0.9,
    "learner.steps_per_round": 4096,
    "learner.n_epochs": 10,
    "learner.lr": 3e-4,
    "learner.target_kl": 0.03,
    "learner.hidden": (128, 128),
    "learner.average": 0.95,
}

_AIRL = _STEADY | {
    "learner.gae_lambda": 0.9,
    "learner.batch_size": 128,
    "learner.n_epochs": 10,
    "learner.lr": 5e-4,
    "learner.average": 0.95,
    "schedule.epochs": 2,
}

PRESETS: dict[str, Preset] = {
    "dac-paper": Preset(
        "dac-td3",
        "the code of Kostrikov et al. (2019), arXiv:1809.02925: google-research/dac",
        "updates follow each step (each episode there), the actor's from the first on (after 1000 there); "
        "its rate stays (halved every 100,000 steps there); weights begin as SB3's",
        {
            "demo_episodes": 4,
            "demo_rate": 20,
            "steps": 1_000_000,
            **_TD3,
            "learner.hidden": (400, 300),
            "learner.lr": 1e-3,
            "learner.batch_size": 100,
            "learner.learning_starts": 1000,
            "discriminator.hidden": (256, 256),
            "discriminator.lr": 1e-3,
            "discriminator.gradient_penalty": 10.0,
            "discriminator.absorbing_scale": 1.0,
        },
    ),
    "orsini": Preset(
        "gail-td3",
        "run_gail.py of acme, released beside Orsini et al. (2021), arXiv:2106.00672",
        "updates follow each step of one environment; networks of the learner are SB3's",
        {
            "steps": 1_000_000,
            **_TD3,
            "learner.lr": 3e-4,
            "learner.batch_size": 256,
            "discriminator.hidden": (64,),
            "discriminator.activation": "relu",
            "discriminator.spectral_norm": True,
            "discriminator.gradient_penalty": 10.0,
            "discriminator.entropy": 1e-3,
            "discriminator.lr": 1e-5,
            "discriminator.reward_map": "gail",
        },
    ),
    "pragmatic": Preset(
        "dac",
        "the default settings in the code of Arulkumaran & Lillrank (2023), A Pragmatic Look at Deep "
        "Imitation Learning",
        "weight decay is on the discriminator alone; one hidden layer of 64",
        _SAC
        | {
            "steps": 1_000_000,
            "learner.lr": 3e-4,
            "learner.gamma": 0.97,
            "discriminator.hidden": (64,),
            "discriminator.activation": "relu",
            "discriminator.lr": 3e-5,
            "discriminator.weight_decay": 10.0,
            "discriminator.gradient_penalty": 1.0,
            "discriminator.penalty_center": 0.0,
            "discriminator.spectral_norm": True,
            "discriminator.input_dropout": 0.5,
            "discriminator.dropout": 0.75,
        },
    ),
    "gail-paper": Preset(
        "gail",
        "the code of Ho & Ermon (2016), arXiv:1606.03476: openai/imitation",
        "the learner is PPO (TRPO there)",
        {
            "demo_rate": 20,
            "steps": 25_000_000,
            "learner.steps_per_round": 50_000,
            "learner.batch_size": 500,
            "learner.gamma": 0.995,
            "learner.gae_lambda": 0.97,
            "learner.hidden": (100, 100),
            "discriminator.lr": 1e-2,
            "discriminator.gradient_penalty": 0.0,
            "discriminator.entropy": 1e-3,
            "schedule.batch_size": 50_000,
            "schedule.epochs": 1,
        },
    ),
    "kostrikov-ppo": Preset(
        "gail",
        "the code of Kostrikov: pytorch-a2c-ppo-acktr-gail",
        "no warm-up of 100 epochs in the first ten rounds; observations are normalised by the demonstrations",
        {
            "steps": 10_000_000,
            "discriminator.hidden": (100, 100),
            "discriminator.lr": 1e-3,
            "discriminator.gradient_penalty": 10.0,
            "discriminator.reward_map": "logit",
            "schedule.batch_size": 128,
            "schedule.epochs": 5,
        },
    ),
    "imitation-halfcheetah": Preset(
        "gail",
        "tuned_hps/gail_seals_half_cheetah_best_hp_eval.json of HumanCompatibleAI/imitation 1.0.1",
        "eight discriminator steps a round of 4096 rows each (8192 there); policy and value share no layers",
        {
            "steps": 10_000_000,
            "learner.n_envs": 8,
            "learner.steps_per_round": 4096,
            "learner.batch_size": 64,
            "learner.n_epochs": 5,
            "learner.clip_range": 0.1,
            "learner.lr": 2.625e-4,
            "learner.lr_schedule": "constant",
            "learner.gamma": 0.95,
            "learner.gae_lambda": 0.95,
            "learner.ent_coef": 3.992e-6,
            "learner.vf_coef": 0.1148,
            "learner.max_grad_norm": 0.8,
            "learner.hidden": (32, 32),
            "discriminator.hidden": (32, 32),
            "discriminator.activation": "relu",
            "discriminator.gradient_penalty": 0.0,
            "schedule.batch_size": 4096,
            "schedule.epochs": 8,
        },
    ),
    "airl-paper": Preset(
        "airl",
        "appendix D and the code of Fu et al. (2018), arXiv:1710.11248",
        "the learner is PPO (TRPO there) and is paid f (g there); gamma in f is the learner's (1 there)",
        {
            "steps": 5_000_000,
            "learner.n_envs": 10,
            "learner.steps_per_round": 10_000,
            "learner.batch_size": 500,
            "learner.gae_lambda": 1.0,
            "learner.average": 0.0,
            "learner.ent_coef": 0.1,
            "discriminator.hidden": (32, 32),
            "discriminator.potential_hidden": (32, 32),
            "discriminator.activation": "relu",
            "discriminator.lr": 1e-3,
            "discriminator.reward": "f",
            "discriminator.terminal": "mask",
            "discriminator.gradient_penalty": 0.0,
            "discriminator.log_pi_bound": 10.0,
            "schedule.batch_size": 100,
            "schedule.epochs": 1,
            "schedule.warmup_rounds": 0,
            "schedule.negatives": 20,
            "schedule.memory": 0,
        },
    ),
    "dac-halfcheetah": Preset(
        "dac",
        "scripts/benchmarks/RESULTS.md: with a rate that falls to 0 it stood still at .78 from 80k steps on",
        "nothing: it is irl's own",
        _STEADY | {"steps": 100_000},
    ),
    "dac-walker2d": Preset(
        "dac",
        "scripts/benchmarks/RESULTS.md: a quarter of demonstration steps was ahead on the one seed that "
        "ran with and without it; on HalfCheetah it was behind",
        "nothing: it is irl's own",
        _STEADY | {"steps": 150_000, "schedule.expert_share": 0.25},
    ),
    "gail-steady": Preset(
        "gail",
        "scripts/benchmarks/RESULTS.md: with the defaults half of PPO's ratios are clipped each round, and "
        "the deviation of its actions is gone before it runs as fast as the expert",
        "nothing: it is irl's own",
        _SHORT | {"steps": 1_000_000},
    ),
    "gail-ant": Preset(
        "gail",
        "scripts/benchmarks/RESULTS.md: `gail-steady`, which falls less where random actions say too what "
        "an observation of the usual size is",
        "nothing: it is irl's own",
        _SHORT | {"steps": 1_000_000, "normaliser": "mixed"},
    ),
    "airl-ant": Preset(
        "airl",
        "scripts/benchmarks/RESULTS.md: as `gail-ant`; with the defaults and the other presets it runs a few "
        "lengths and falls",
        "nothing: it is irl's own",
        _SHORT | {"steps": 2_000_000, "normaliser": "mixed", "learner.average": 0.98},
    ),
    "airl-walker2d": Preset(
        "airl",
        "scripts/benchmarks/RESULTS.md: with the penalty at 10 f is no steeper than 1, the policy no "
        "surer of its actions than that, and its gait slower than the expert's",
        "nothing: it is irl's own",
        _AIRL
        | {
            "steps": 1_000_000,
            "schedule.memory": 0,
            "discriminator.gradient_penalty": 0.1,
            "discriminator.log_pi_bound": 10.0,
        },
    ),
    "airl-halfcheetah": Preset(
        "airl",
        "scripts/benchmarks/RESULTS.md: the expert's actions lie at the bounds, so log pi tells it from the "
        "policy for as long as it may be large, and pays the policy for noise",
        "nothing: it is irl's own",
        _AIRL
        | {
            "steps": 2_000_000,
            "learner.n_epochs": 20,
            "learner.clip_range": 0.1,
            "learner.target_kl": 0.04,
            "learner.average": 0.98,
            "schedule.memory": 200_000,
            "discriminator.gradient_penalty": 5.0,
            "discriminator.log_pi_bound": 2.0,
        },
    ),
    "airl-sac-halfcheetah": Preset(
        "airl-sac",
        "scripts/benchmarks/RESULTS.md: where log pi may be large D tells the two by it and f learns little",
        "nothing: it is irl's own",
        _STEADY
        | {"steps": 200_000, "discriminator.gradient_penalty": 5.0, "discriminator.log_pi_bound": 2.0},
    ),
}
"""By name."""
