"""What `irl evaluate` reads on a probe: distances of the reward, and how its snapshots drifted."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from gymnasium.spaces import Box

from irl.algorithms.probe_make import drawn, play
from irl.algorithms.probe_set import ProbeSet
from irl.core.rng import stream
from irl.core.types import Episode, from_episodes
from irl.demos.load import Demos
from irl.envs.make import make
from irl.envs.states import StateRecorder
from irl.experiment.attributed import judge_terms
from irl.experiment.configs import Imitation
from irl.experiment.distances import judge_distances
from irl.experiment.drifting import Played, judge_snapshots
from irl.experiment.logits import Snapshot
from irl.experiment.probes import base_of, given, own_of
from irl.experiment.progress import progress
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


def probed(
    config: Imitation,
    demos: Demos,
    policies: Mapping[int, Policy],
    rewards: Mapping[int, LearnedReward],
    asked: Asked,
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """The `distances` and `terms` of evaluation.json, and what is added to its `drift`.

    Where demonstrations have no actions and the shelf no expert there is nothing to compare on: a reason.

    Raises:
        UserError: the probe that was given is of another task, or damaged.
    """
    expert = demos.held_out or demos.episodes
    actions = demos[0].action.shape[1] > 0
    known = shelf.expert_card(config.env_id, asked.policies_root) is not None
    if asked.probe is None and not known and not actions:
        reason = "the demonstrations have no actions, and the shelf no expert"
        return {"headline_reason": reason}, {"reason": reason}, {}
    if asked.probe is not None:
        probe = given(asked.probe, config.env_id)
    else:
        probe = base_of(config.env_id, asked.policies_root, expert, asked.steps)
    own = {name: episodes for name, episodes in probe.items() if name not in probe.base}
    base, own = probe.base, own or dict(own_of(config.env_id, policies, asked.steps))
    reward = rewards[max(rewards)]
    distances = judge_distances(reward, base, own, asked.also, asked.seed)
    terms = judge_terms(reward, base, reward.spec.gamma, asked.seed)
    return distances, terms, _drift(config, demos, policies, rewards, base, asked)


def _drift(
    config: Imitation,
    demos: Demos,
    policies: Mapping[int, Policy],
    rewards: Mapping[int, LearnedReward],
    base: ProbeSet,
    asked: Asked,
) -> dict[str, Any]:
    both = {at: Snapshot(rewards[at], policies[at]) for at in rewards}
    total = 3 * len(both) + 1
    with progress("drift", total) as report:
        fresh = {}
        for i, (at, policy) in enumerate(policies.items(), 1):
            fresh[at] = fresh_episodes(config.env_id, policy, at, min(FRESH, asked.steps))
            report(i, f"policy at {at}")
        held_out = from_episodes(list(demos.held_out)) if demos.held_out else None
        played = Played(from_episodes(list(demos.episodes)), held_out, fresh)
        return judge_snapshots(
            both, base, played, asked.seed, lambda done, words: report(len(both) + done, words)
        )


def fresh_episodes(env_id: str, policy: Policy, at: int, steps: int) -> tuple[Episode, ...]:
    """Episodes of a snapshot's policy, drawn from as it was in training, without further noise."""
    env = StateRecorder(make(env_id))
    try:
        assert isinstance(env.action_space, Box)
        return play(env, drawn(policy, stream(0, f"fresh actions/{at}")), f"fresh/{at}", steps)
    finally:
        env.close()
