"""What `irl evaluate` reads on a probe: distances of the reward, and how its snapshots drifted."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from gymnasium.spaces import Box

from irl.algorithms.probe_make import drawn, play
from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import stream
from irl.core.types import Episode, Transitions, from_episodes
from irl.demos.load import Demos
from irl.envs.make import make
from irl.envs.states import StateRecorder
from irl.experiment import build
from irl.experiment.attributed import judge_terms
from irl.experiment.configs import Imitation
from irl.experiment.crossplay import play_policies
from irl.experiment.distances import judge_distances
from irl.experiment.drifting import Played, judge_snapshots
from irl.experiment.logits import Snapshot
from irl.experiment.probes import base_of, given, own_of
from irl.experiment.progress import progress
from irl.experiment.trusted import Seen, judge_trust, nothing
from irl.policies import shelf
from irl.policies.policy import Policy
from irl.rewards.learned import LearnedReward

Named = Literal["pearson", "spearman", "kendall", "erc", "starc-val", "npec", "epic"]
"""`irl.diagnostics.references.NAMES`."""
FRESH = 2000
"""Steps of each snapshot's own policy that its discriminator is judged on, or less where the probe is."""


@dataclass(frozen=True)
class Asked:
    """What of a probe was asked for."""

    probe: Path | None
    steps: int
    also: tuple[Named, ...]
    seed: int
    policies_root: Path | None


@dataclass(frozen=True)
class Probed:
    """Parts of evaluation.json."""

    distances: dict[str, Any]
    terms: dict[str, Any]
    drift: dict[str, Any]
    """What is added to it."""
    trust: dict[str, Any]
    """The parts that `irl.experiment.trusted` names."""


def probed(
    config: Imitation,
    demos: Demos,
    policies: Mapping[int, Policy],
    rewards: Mapping[int, LearnedReward],
    asked: Asked,
) -> Probed:
    """What is read on a probe.

    Where demonstrations have no actions and the shelf no expert there is nothing to compare on: a reason.

    Raises:
        UserError: the probe that was given is of another task, or damaged.
    """
    expert = demos.held_out or demos.episodes
    reward = rewards[max(rewards)]
    actions = demos[0].action.shape[1] > 0
    known = shelf.expert_card(config.env_id, asked.policies_root) is not None
    if asked.probe is None and not known and not actions:
        reason = "the demonstrations have no actions, and the shelf no expert"
        return Probed({"headline_reason": reason}, {"reason": reason}, {}, nothing(reason, reward))
    if asked.probe is not None:
        probe = given(asked.probe, config.env_id)
    else:
        probe = base_of(config.env_id, asked.policies_root, expert, asked.steps)
    own = {name: episodes for name, episodes in probe.items() if name not in probe.base}
    base, own = probe.base, own or dict(own_of(config.env_id, policies, asked.steps))
    distances = judge_distances(reward, base, own, asked.also, asked.seed)
    terms = judge_terms(reward, base, reward.spec.gamma, asked.seed)
    fresh = _fresh(config.env_id, policies, min(FRESH, asked.steps))
    health = Played(_learned_from(config, demos), _held_out(demos), fresh)
    drift = _drift(health, policies, rewards, base, asked.seed)
    played = play_policies(config.env_id, policies, base, asked.seed, asked.policies_root)
    seen = Seen(rewards, base, played, _held_out(demos), fresh)
    return Probed(distances, terms, drift, judge_trust(seen, drift, asked.seed))


def _fresh(env_id: str, policies: Mapping[int, Policy], steps: int) -> dict[int, tuple[Episode, ...]]:
    found = {}
    with progress("fresh play", len(policies)) as report:
        for i, (at, policy) in enumerate(policies.items(), 1):
            found[at] = fresh_episodes(env_id, policy, at, steps)
            report(i, f"policy at {at}")
    return found


def _drift(
    played: Played,
    policies: Mapping[int, Policy],
    rewards: Mapping[int, LearnedReward],
    base: ProbeSet,
    seed: int,
) -> dict[str, Any]:
    both = {at: Snapshot(rewards[at], policies[at]) for at in rewards}
    with progress("drift", 2 * len(both) + 1) as report:
        return judge_snapshots(both, base, played, seed, report)


def _learned_from(config: Imitation, demos: Demos) -> Transitions:
    """The steps that were kept of the demonstrations; none of the absorbing state, which nobody plays."""
    steps = build.demonstrations(config, demos.episodes)
    return steps if steps.absorbing is None else steps[~steps.absorbing]


def _held_out(demos: Demos) -> Transitions | None:
    return from_episodes(list(demos.held_out)) if demos.held_out else None


def fresh_episodes(env_id: str, policy: Policy, at: int, steps: int) -> tuple[Episode, ...]:
    """Episodes of a snapshot's policy, drawn from as it was in training, without further noise."""
    env = StateRecorder(make(env_id))
    try:
        assert isinstance(env.action_space, Box)
        return play(env, drawn(policy, stream(0, f"fresh actions/{at}")), f"fresh/{at}", steps)
    finally:
        env.close()
