"""The discriminator of discriminator-actor-critic (Kostrikov et al. 2019, arXiv:1809.02925).

    D  <-  argmin  -E_expert[w log D(s,a)] / E_expert[w] - E_replay[log(1 - D(s,a))]     (losses.bce)
                   + 10 E[(|grad logit(x)| - 1)^2]                        (regularisers.slope_penalty)
    r  =   log D(s,a) - log(1 - D(s,a)) = logit(s,a)                      (maps.logit)

over steps that go on in the absorbing state s_abs (envs.absorbing), whose reward is learned like any
other. w is the weight of a row: 1 / rate for s_abs in demonstrations of which every rate-th step was kept.
It is GAIL's classifier with other settings; what makes it DAC is s_abs, and that the policy's steps come
from a replay memory, without importance weights (section 4.1 of the paper says why none are needed).

Differs from the paper: the indicator of s_abs is scaled by 10 and not by 1, because under a one-centred
penalty s_abs otherwise lies nearer to the expert than a fall does; observations are normalised by the
demonstrations' fixed moments, the indicator is not; layers of 128 (the text has 100, the authors' code 256);
Adam at 3e-4 (1e-3 there); s_T -> s_abs weighs as s_abs does.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from irl.discriminators.gail import GAIL, GAILConfig
from irl.discriminators.switches import SwitchesConfig


@dataclass(frozen=True)
class DACConfig(GAILConfig):
    """How the discriminator learns: GAIL's settings with DAC's values."""

    ADDED: ClassVar[dict[str, Any]] = SwitchesConfig.ADDED | {
        "inputs": "obs_action",
        "products": "float32",
        "lr_schedule": "constant",
    }

    hidden: tuple[int, ...] = (128, 128)
    """Width of each hidden layer."""
    lr: float = 3e-4
    """Adam step size."""
    gradient_penalty: float = 10.0
    """Weight of the gradient penalty; 0 turns it off."""
    reward_map: Literal["gail", "logit", "log_d", "fairl"] = "logit"
    """From the logit to the reward; irl/rewards/maps.py says what each does where episodes end early."""
    absorbing_scale: float = 10.0
    """Distance of the absorbing state from all others; 0: there is none."""


class DAC(GAIL):
    """A classifier that knows the absorbing state, updated once an environment step."""
