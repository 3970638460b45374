"""Make a probe: the base of a task, and strata of a run's own policies.

The expert's part is new episodes of the shelf's expert, from resets that no dataset of irl's has: held out
from every run, whichever demonstrations it drew. Where the shelf has no policy of a middling level, the
expert with strong action noise stands in for it, and the probe says so.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import gymnasium as gym
from gymnasium.spaces import Box

from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import episode_seeds, stream
from irl.core.types import ActFn, Episode
from irl.envs.make import make
from irl.envs.noise import noised
from irl.envs.rollouts import random_act, rollout
from irl.envs.states import StateRecorder
from irl.policies.policy import Policy

STEPS = 5000
"""Steps of one stratum."""
MOST_EPISODES = 25
"""Full-length episodes of one stratum, at most: a task of short ones has a smaller probe."""
NOISY, MEDIUM, OWN = 0.3, 0.6, 0.1
"""Action noise, in halves of the range: of the noisy expert, of a medium made of it, and of a run's own
policies, which are near-deterministic late in training."""
SHARES = (0, 25, 50, 75, 100)
"""Of a run, in percent: when its own policies are taken."""

OnEpisode = Callable[[Episode], None]


def base_probe(
    env_id: str,
    expert: Policy | None,
    medium: Policy | None = None,
    held_out: Sequence[Episode] = (),
    steps: int = STEPS,
    on_episode: OnEpisode | None = None,
) -> ProbeSet:
    """The base probe of a task: the same for the same policies, wherever it is made.

    Args:
        expert: of the shelf; without one, `held_out` is the expert's part and there is no noisy one.
        medium: of the shelf, where there is one.
        held_out: demonstrations that were not trained on.
        steps: of each stratum, or `MOST_EPISODES` full-length episodes.
    Raises:
        UserError: the environment cannot be made.
        ValueError: there is neither an expert nor a held-out demonstration.
    """
    if expert is None and not held_out:
        raise ValueError(f"a probe of {env_id} needs an expert or demonstrations")
    env = StateRecorder(make(env_id))
    try:
        space = env.action_space
        assert isinstance(space, Box)
        players: dict[str, tuple[ActFn, str]] = {}
        if expert is not None:
            players = _experts(expert, medium, space)
        players["random"] = random_act(space, stream(0, "probe/random")), "uniformly random actions"
        strata = {name: play(env, act, name, steps, on_episode) for name, (act, _) in players.items()}
    finally:
        env.close()
    about = {name: words for name, (_, words) in players.items()}
    if expert is None:
        strata = {"expert": _first(held_out, steps)} | strata
        about["expert"] = "demonstrations that were held out of the training"
    return ProbeSet(env_id, strata, about)


def own_strata(
    env_id: str,
    policies: Mapping[int, Policy],
    steps: int = STEPS,
    on_episode: OnEpisode | None = None,
) -> ProbeSet:
    """A stratum for each of a run's policies, by their share of the run in percent; drawn with noise."""
    env = StateRecorder(make(env_id))
    try:
        space = env.action_space
        assert isinstance(space, Box)
        strata, about = {}, {}
        for share, policy in policies.items():
            name = f"policy at {share} %"
            rng = stream(0, f"probe/{name}")
            act = noised(drawn(policy, stream(0, f"probe/actions {name}")), space, OWN, rng)
            strata[name] = play(env, act, name, steps, on_episode)
            about[name] = f"the run's policy, drawn from, with action noise {OWN:g}"
        return ProbeSet(env_id, strata, about)
    finally:
        env.close()


def at_shares(snapshots: Sequence[int], shares: Sequence[int] = SHARES) -> dict[int, int]:
    """By share of the run in percent, the step of the snapshot nearest to it; each snapshot once.

    >>> at_shares([0, 10, 25, 50, 75, 100])
    {0: 0, 25: 25, 50: 50, 75: 75, 100: 100}
    >>> at_shares([0, 100])
    {0: 0, 100: 100}
    """
    last = max(snapshots)
    nearest = {share: min(snapshots, key=lambda s: abs(s - share * last / 100)) for share in shares}
    error = {share: abs(step - share * last / 100) for share, step in nearest.items()}
    chosen: dict[int, int] = {}
    for share in sorted(shares, key=lambda share: (error[share], share)):
        if nearest[share] not in chosen.values():
            chosen[share] = nearest[share]
    return dict(sorted(chosen.items()))


def play(
    env: StateRecorder, act: ActFn, name: str, steps: int, on_episode: OnEpisode | None = None
) -> tuple[Episode, ...]:
    """Whole episodes of `act`, `steps` or more in all; their resets hang on `name` alone."""
    wanted, seeds = _wanted(env, steps), iter(episode_seeds(0, f"probe/{name}", steps))
    episodes: list[Episode] = []
    while sum(map(len, episodes)) < wanted:
        episode = rollout(env, act, next(seeds))
        episodes.append(replace(episode, infos={**episode.infos, **env.columns()}))
        if on_episode is not None:
            on_episode(episodes[-1])
    return tuple(episodes)


def drawn(policy: Policy, rng) -> ActFn:
    """The policy's own distribution."""
    return lambda obs: policy.sample(obs, rng)


def _experts(expert: Policy, medium: Policy | None, space: Box) -> dict[str, tuple[ActFn, str]]:
    def worse(policy: Policy, level: float, name: str) -> ActFn:
        return noised(policy, space, level, stream(0, f"probe/{name}"))

    noise = "the expert with action noise"
    middling = (
        (worse(medium, OWN, "medium"), f"the shelf's medium policy with action noise {OWN:g}")
        if medium is not None
        else (worse(expert, MEDIUM, "medium"), f"no medium policy is shelved: {noise} {MEDIUM:g}")
    )
    return {
        "expert": (expert, "the shelf's expert, from resets that no demonstration has"),
        "medium": middling,
        "noisy expert": (worse(expert, NOISY, "noisy expert"), f"{noise} {NOISY:g}"),
    }


def _wanted(env: gym.Env, steps: int) -> int:
    limit = env.spec.max_episode_steps if env.spec is not None else None
    return min(steps, MOST_EPISODES * limit) if limit else steps


def _first(episodes: Sequence[Episode], steps: int) -> tuple[Episode, ...]:
    before = itertools.accumulate((len(episode) for episode in episodes), initial=0)
    return tuple(episode for episode, passed in zip(episodes, before, strict=False) if passed < steps)
