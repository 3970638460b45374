"""What moved between two snapshots of a reward, read on the same steps.

    E[(r_t - r_s)^2] = (mu_t - mu_s)^2  +  (sigma_t - sigma_s)^2  +  2 sigma_t sigma_s (1 - rho)
                          offset               scale                     shape

An offset is a survival bonus where episodes can end early and means nothing where they cannot; a
scale means nothing to a learner that normalises; only the shape changes what the reward asks for.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Split:
    """The mean squared change of a reward in its three parts, each in squared reward units."""

    offset: float
    """(mu_t - mu_s)^2: everything became better or worse by the same amount."""
    scale: float
    """(sigma_t - sigma_s)^2: the differences between steps grew or shrank."""
    shape: float
    """2 sigma_t sigma_s (1 - rho): other steps are preferred than before."""
    total: float
    """E[(r_t - r_s)^2], measured on its own: the three parts add up to it."""

    @property
    def shares(self) -> dict[str, float]:
        """Each part over the total, by name; NaN where nothing moved."""
        parts = {"offset": self.offset, "scale": self.scale, "shape": self.shape}
        return {name: part / self.total if self.total > 0 else float("nan") for name, part in parts.items()}


def split(before: Float[np.ndarray, "N"], after: Float[np.ndarray, "N"]) -> Split:
    """Offset, scale and shape of the change from `before` to `after`, two rewards of the same steps.

    Each part is computed from the difference of the rewards, so that a change a million times
    smaller than the rewards keeps its digits: 1 - rho taken literally would lose them all.
    A constant reward has sigma = 0, hence no shape.

    Raises:
        ValueError: there is no step, or the two differ in length.
    """
    if len(before) == 0 or len(before) != len(after):
        raise ValueError(f"expected two rewards of the same steps: {len(before)} and {len(after)} values")
    old, new = np.asarray(before, dtype=np.float64), np.asarray(after, dtype=np.float64)
    change = new - old
    offset = float(np.mean(change))
    old, new, centred = _centred(old), _centred(new), change - offset
    sigma_old, sigma_new = float(np.std(old)), float(np.std(new))
    sigma_sum = sigma_old + sigma_new
    # sigma_t - sigma_s = (var_t - var_s) / (sigma_t + sigma_s), free of cancellation
    growth = float(np.mean(centred * (new + old))) / sigma_sum if sigma_sum > 0 else 0.0
    shape = 0.0
    if sigma_old > 0 and sigma_new > 0:
        # 2 (1 - rho) = E[(z_t - z_s)^2] of the standardised rewards z
        residual = centred * (sigma_old / sigma_sum) - old * (growth / sigma_sum)
        shape = float(np.mean(residual**2)) * (sigma_sum / sigma_old) * (sigma_sum / sigma_new)
    return Split(offset=offset**2, scale=growth**2, shape=shape, total=float(np.mean(change**2)))


def _centred(values: Float[np.ndarray, "N"]) -> Float[np.ndarray, "N"]:
    if np.ptp(values) == 0:
        # the mean of a constant can miss it by a rounding, which would look like a spread
        return np.zeros_like(values)
    return values - np.mean(values)
