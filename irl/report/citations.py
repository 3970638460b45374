"""Papers to cite for a run, and the formula of the reward that it used."""

from collections.abc import Mapping
from typing import Any

METHODS = {
    "gail": ("GAIL", "Ho & Ermon (2016), Generative Adversarial Imitation Learning, arXiv:1606.03476"),
    "airl": (
        "AIRL",
        "Fu, Luo & Levine (2018), Adversarial Inverse Reinforcement Learning, arXiv:1710.11248",
    ),
    "dac": ("DAC", "Kostrikov et al. (2019), Discriminator-Actor-Critic, arXiv:1809.02925"),
}
LEARNERS = {
    "ppo": ("PPO", "Schulman et al. (2017), Proximal Policy Optimization Algorithms, arXiv:1707.06347"),
    "sac": ("SAC", "Haarnoja et al. (2018), Soft Actor-Critic, arXiv:1801.01290"),
}
ALWAYS = (
    ("the distance", "Skalse et al. (2024), STARC, arXiv:2309.15257"),
    (
        "the shaping that it forgives",
        "Ng, Harada & Russell (1999), Policy Invariance under Reward Transformations",
    ),
    (
        "interquartile means",
        "Agarwal et al. (2021), Deep RL at the Edge of the Statistical Precipice, arXiv:2108.13264",
    ),
)
"""Of every page."""
FORMULAS = {
    "gail": "r = -log(1 - D) = softplus(h), h the logit; never negative, so that to go on always pays",
    "logit": "r = log D - log(1 - D) = h, the logit; of either sign",
    "log_d": "r = log D, h the logit, D = sigmoid(h); never positive, so that to end always pays",
    "fairl": "r = -h exp(h), h the logit",
    "g": "r = g, what a step is worth without shaping",
    "f": "r = f = g + gamma h(s') - h(s)",
    "f-log-pi": "r = f - log pi(a | s), with the policy of the snapshot",
}
"""By the name of the map that a saved reward carries (irl.rewards.maps, irl.rewards.shaped)."""


def citations(kind: str) -> list[tuple[str, str]]:
    """What to cite for a run of this kind; nothing where the kind is not known."""
    method, _, learner = kind.partition("-")
    if method not in METHODS:
        return []
    learner = learner or ("sac" if method == "dac" else "ppo")
    return [METHODS[method], *([LEARNERS[learner]] if learner in LEARNERS else []), *ALWAYS]


def formula(spec: Mapping[str, Any]) -> str:
    """The formula of the reward that a spec.json describes."""
    name = str(spec.get("reward_map"))
    return FORMULAS.get(name, f"the map called {name}")
