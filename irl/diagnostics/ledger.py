"""What the reward of each method can determine and what it cannot, however well it is learned.

No measurement shows these: two rewards that differ by an invariance of the data are equally right, and a
number that tells them apart tells of the initialisation. So a reward is read with its method's row beside it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

RATIO, G, G_STATES, F, F_LOG_PI = "log ratio", "g", "g of states", "f", "f - log pi"


@dataclass(frozen=True)
class Ledger:
    """One kind of reward."""

    determines: tuple[str, ...]
    cannot: tuple[str, ...]
    source: str


_SHAPING = "a potential: any shaping of the reward has the same optimal policies"
_DATA = "anything where neither the expert nor the policy went"
_SCALE = "its scale, but against the entropy that the expert is taken to have"

LEDGERS: Mapping[str, Ledger] = MappingProxyType(
    {
        RATIO: Ledger(
            determines=(
                "where the expert is likelier than the policy of that moment, and by what factor: the logit "
                "is the logarithm of the ratio of their densities",
                "how far the policy of that moment still is from the expert",
            ),
            cannot=(
                "what the task is: once the policy plays as the expert does the logit is a constant",
                "what pays by itself: the same steps pay less the more often the policy makes them",
                "a scale or an offset that means anything at another moment of the run",
                _DATA,
            ),
            source="Ho & Ermon (2016), arXiv:1606.03476; Kostrikov et al. (2019), arXiv:1809.02925",
        ),
        G_STATES: Ledger(
            determines=(
                "the reward up to a constant, where the true one is of states alone, the dynamics are "
                "deterministic and decomposable, and the expert is optimal with entropy",
            ),
            cannot=(
                "what an action costs: a function of states alone has no control cost",
                "a constant, which is a survival bonus where an episode can end early",
                _SCALE,
                _DATA,
            ),
            source="Fu et al. (2018), arXiv:1710.11248",
        ),
        G: Ledger(
            determines=("a reward under which the expert is optimal, under the dynamics it was learned in",),
            cannot=(
                "reward apart from advantage: seeing actions, g can hold what h was to take off",
                _SHAPING,
                "a constant, which is a survival bonus where an episode can end early",
                _SCALE,
                _DATA,
            ),
            source="Fu et al. (2018), arXiv:1710.11248; Skalse et al. (2023), arXiv:2203.07475",
        ),
        F: Ledger(
            determines=(
                "the advantage of the expert's soft-optimal policy: at the optimum f is log pi of the expert",
            ),
            cannot=(
                "reward apart from value: an advantage holds the dynamics, and misleads under others",
                _SHAPING,
                _DATA,
            ),
            source="Fu et al. (2018), arXiv:1710.11248; Cao, Cohen & Szpruch (2021), NeurIPS",
        ),
        F_LOG_PI: Ledger(
            determines=("the logarithm of the ratio of expert and policy, as GAIL's logit does",),
            cannot=(
                "what the task is: once the policy plays as the expert does it is a constant",
                "a reward without the policy whose log pi it holds",
                _DATA,
            ),
            source="Fu et al. (2018), arXiv:1710.11248",
        ),
    }
)
"""By kind of reward."""
