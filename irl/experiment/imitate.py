"""Imitation with a model of Stable-Baselines3's own making, from Python.

>>> from stable_baselines3 import PPO
>>> import irl
>>> model = PPO("MlpPolicy", "Hopper-v5", learning_rate=1e-4)                       # doctest: +SKIP
>>> demos = irl.load_demos("irl/hopper/expert-v0", episodes=5)                      # doctest: +SKIP
>>> reward = irl.imitate(model, demos, method="gail", steps=200_000)                # doctest: +SKIP
"""

from collections.abc import Callable, Sequence
from typing import Any

from irl.algorithms.adversarial import Adversarial, ReplayedScheduleConfig, ScheduleConfig
from irl.algorithms.interleaved import Interleaved, InterleavedConfig
from irl.algorithms.loop import Round
from irl.core.nets import fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import Episode, Transitions, from_episodes
from irl.demos.bounds import action_outside
from irl.demos.load import Demos
from irl.discriminators.airl import AIRL, AIRLConfig
from irl.discriminators.ensemble import Ensemble, one_or_several
from irl.discriminators.gail import GAIL, GAILConfig
from irl.envs.absorbing import absorb
from irl.envs.tasks import known_apart
from irl.learners.ready import ReadyPPO, ReadySAC, ready
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.nets import SEES

Schedule = ScheduleConfig | InterleavedConfig


def imitate(
    model: Any,
    demos: Sequence[Episode],
    *,
    method: str = "gail",
    steps: int,
    seed: int = 0,
    discriminator: GAILConfig | AIRLConfig | None = None,
    schedule: Schedule | None = None,
    on_round: Callable[[Round], None] | None = None,
) -> LearnedReward:
    """Train a ready-made PPO or SAC on a reward learned from `demos`; the reward as it is at the end.

    The model is trained in place, from where it is: what was learned before counts. Its settings, its
    environments and its memory (a SAC's, without these steps) are as before when it ends, so it can learn on.
    Time limits, and what follows a termination, are as with `irl train`.

    Args:
        model: of stable_baselines3, with environments of flat Box observations and actions.
        demos: episodes of the same task.
        method: `gail` or `airl`. DAC is refused: its actor and critics see the indicator of the absorbing
            state, so they must be made for it; `irl train dac` makes them.
        steps: environment steps; the last round may go past them.
        seed: of the discriminator; the model has its own.
        discriminator: settings; the method's defaults unless given.
        schedule: `ScheduleConfig` for PPO, `InterleavedConfig` for SAC; the method's defaults unless given.
        on_round: told of each round, e.g. to print its metrics.

    Raises:
        ValueError: the model, the demonstrations or the settings do not go together; the message says why.
        NotFinite: a weight or a reward became NaN or infinite.
    """
    if method not in ("gail", "airl"):
        raise ValueError(_refused(method))
    # no round at all would leave a reward that nothing has taught
    if steps < 1:
        raise ValueError(f"steps must be at least 1, not {steps}")
    expert = from_episodes(demos)
    settings = discriminator or _defaults(method, type(model).__name__)
    _check(model, expert, method, settings)
    _check_demonstrations(model, demos)
    scale = settings.scale if isinstance(settings, AIRLConfig) else settings.absorbing_scale
    learner = ready(model, steps, absorbing=scale > 0)
    try:
        judge = _discriminator(learner, expert, settings, seed)
        if scale:
            expert = absorb(expert)
        rng = torch_stream(seed, "minibatches", model.device)
        algorithm = _algorithm(learner, judge, expert.to(model.device), schedule, rng, scale > 0)
        for round_ in algorithm.rounds(steps):
            if on_round is not None:
                on_round(round_)
        return _reward(learner, judge, method, seed)
    finally:
        learner.close()


def _refused(method: str) -> str:
    if method == "dac":
        return (
            "DAC's actor and critics see the indicator of the absorbing state, so a ready-made model, which "
            "was made without it, cannot be its learner; use: irl train dac, or method='gail' with a SAC"
        )
    return f"unknown method {method!r}; expected 'gail' or 'airl'"


def _defaults(method: str, algorithm: str) -> GAILConfig | AIRLConfig:
    if method == "gail":
        return GAILConfig()
    # SAC pays for entropy itself
    return AIRLConfig(lr=3e-4, reward="f") if algorithm == "SAC" else AIRLConfig()


def _check(model: Any, expert: Transitions, method: str, settings: GAILConfig | AIRLConfig) -> None:
    if method == "airl" and type(model).__name__ in ("TD3", "DDPG"):
        raise ValueError(
            f"AIRL's discriminator is f - log pi, and {type(model).__name__}'s policy has one action for a "
            f"state, so no log pi; use a SAC or PPO"
        )
    if method == "airl" and getattr(model, "use_sde", False):
        raise ValueError(
            f"AIRL needs the density of an action: a {type(model).__name__} of Gaussian actions, "
            f"without use_sde"
        )
    if isinstance(settings, AIRLConfig) != (method == "airl"):
        raise ValueError(f"{type(settings).__name__} are no settings of {method}")
    observations, actions = model.observation_space.shape, model.action_space.shape
    if (expert.obs.shape[1:], expert.action.shape[1:]) != (observations, actions):
        raise ValueError(
            f"the demonstrations have observations of {tuple(expert.obs.shape[1:])} and actions of "
            f"{tuple(expert.action.shape[1:])}, the model {observations} and {actions}"
        )
    bonus = type(model).__name__ == "SAC" or getattr(model, "ent_coef", 0.0) > 0
    if isinstance(settings, AIRLConfig) and settings.reward == "f-log-pi" and bonus:
        raise ValueError(
            "entropy would be paid twice: by the model's ent_coef and by reward='f-log-pi'; use "
            "AIRLConfig(reward='f'), or a PPO with ent_coef=0"
        )


def _check_demonstrations(model: Any, demos: Sequence[Episode]) -> None:
    """Refuse what `irl train` does: actions that the task does not take, and another task of its shapes."""
    for number, episode in enumerate(demos):
        if said := action_outside(episode.action, model.action_space, "the model"):
            raise ValueError(f"episode {number} of the demonstrations has {said}")
    envs = model.get_env()
    spec = envs.get_attr("spec")[0] if envs is not None else None
    its = demos.env_id if isinstance(demos, Demos) else None
    if spec is not None and its is not None and known_apart(its, spec.id):
        raise ValueError(f"the demonstrations are of {its}, the model learns {spec.id}")


def _discriminator(
    learner: ReadyPPO | ReadySAC, expert: Transitions, settings: GAILConfig | AIRLConfig, seed: int
) -> GAIL | AIRL | Ensemble:
    model = learner.model
    sizes = expert.obs.shape[1], expert.action.shape[1]

    def make(called: str) -> GAIL | AIRL:
        shared = {
            "normaliser": fitted_normaliser(expert.obs),
            "init_rng": torch_stream(seed, f"discriminator weights{called}"),
            "rng": torch_stream(seed, f"discriminator{called}", model.device),
            "gamma": model.gamma,
        }
        if isinstance(settings, AIRLConfig):
            return AIRL(*sizes, settings, log_pi=learner.log_pi, **shared)
        return GAIL(*sizes, settings, **shared)

    return one_or_several(settings, make)


def _algorithm(
    learner: ReadyPPO | ReadySAC,
    judge: GAIL | AIRL | Ensemble,
    expert: Transitions,
    schedule: Schedule | None,
    rng: Any,
    absorbing: bool,
) -> Adversarial | Interleaved:
    if isinstance(learner, ReadySAC):
        chosen = schedule or InterleavedConfig()
        if not isinstance(chosen, InterleavedConfig):
            raise ValueError(f"SAC's schedule is an InterleavedConfig, not a {type(chosen).__name__}")
        if chosen.expert_share:
            raise ValueError(
                "a ready-made SAC trains on what is in its own replay_buffer, so expert_share has to be 0; "
                "use: irl train gail-sac --schedule.expert-share"
            )
        return Interleaved(learner, judge, expert, chosen, rng)
    chosen = schedule or (
        ReplayedScheduleConfig() if isinstance(judge.config, AIRLConfig) else ScheduleConfig()
    )
    if not isinstance(chosen, ScheduleConfig):
        raise ValueError(f"PPO's schedule is a ScheduleConfig, not a {type(chosen).__name__}")
    return Adversarial(learner, judge, expert, chosen, rng, absorbing=absorbing)


def _reward(
    learner: ReadyPPO | ReadySAC, judge: GAIL | AIRL | Ensemble, method: str, seed: int
) -> LearnedReward:
    found = learner.venv.get_attr("spec")[0]
    spec = RewardSpec(
        env_id=found.id if found is not None else "",
        method=method,
        reward_map=judge.reward_map,
        inputs=SEES[judge.net.spec.sees],
        net=judge.net.spec,
        gamma=judge.gamma,
        reward_scale=learner.reward_scale,
        env_steps=learner.env_steps,
        provenance={"seed": seed},
    )
    # as `load_reward` gives it: who asks it next has batches of numpy's
    return LearnedReward(spec, judge.net).to("cpu")
