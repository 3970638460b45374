"""Imitation and adversarial reward learning: rewards from demonstrations, judged.

>>> import irl
>>> demos = irl.load_demos("irl/hopper/expert-v0", episodes=4, seed=0)    # doctest: +SKIP
>>> reward = irl.load_reward("runs/hopper")                           # doctest: +SKIP
>>> reward(irl.from_episodes(demos.episodes)).mean()                      # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from irl.algorithms.probe_file import load_probe
from irl.core.errors import UserError
from irl.core.types import Episode, RewardFn, Transitions, concatenate, from_episodes
from irl.demos.load import Demos, load_demos
from irl.envs.rollouts import rollout, rollouts
from irl.policies.policy import Policy, load_policy
from irl.policies.shelf import find as load_expert
from irl.rewards.artefact import load_reward
from irl.rewards.learned import LearnedReward
from irl.rewards.mujoco import HandWritten
from irl.rewards.wrapper import RewardWrapper

if TYPE_CHECKING:
    from irl.diagnostics.diagnose import diagnose
    from irl.experiment.imitate import imitate
    from irl.learners.reward_vec import RewardVecWrapper

__all__ = [
    "Demos",
    "Episode",
    "HandWritten",
    "LearnedReward",
    "Policy",
    "RewardFn",
    "RewardVecWrapper",
    "RewardWrapper",
    "Transitions",
    "UserError",
    "concatenate",
    "diagnose",
    "from_episodes",
    "imitate",
    "load_demos",
    "load_expert",
    "load_policy",
    "load_probe",
    "load_reward",
    "rollout",
    "rollouts",
]


# Stable-Baselines3 and scipy take seconds to import, and only these names need them
_LATER = {
    "RewardVecWrapper": "irl.learners.reward_vec",
    "diagnose": "irl.diagnostics.diagnose",
    "imitate": "irl.experiment.imitate",
}


def __getattr__(name: str) -> Any:
    if name in _LATER:
        return getattr(import_module(_LATER[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
