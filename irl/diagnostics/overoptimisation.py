"""A proxy against gold over a run: does the true return still rise while the learned one does?

    drop          (gold_peak - gold_end) / (gold_peak - gold_0)
    lost          the same with the return of random actions for gold_0
    gap           z(proxy)_end - z(gold)_end                      z over the points
    decoupling    where the first window of 5 points begins in which Spearman(proxy, gold) <= 0
    fit           gold(d) - gold(0) = d (alpha - beta log d),     peak at d* = exp(alpha / beta - 1)

d is the root of a KL divergence in the source, from a policy that was good to begin with. A run starts from
random weights, of which a KL says nothing: d = sqrt(step / last step). The family is the same in any unit of
d; its slope is infinite at 0, so the first point is what the others are held against and is not fitted.

A curve that only rises, or eight points of noise, can be fitted too and mean nothing: the fit is refused
unless there are eight points, its peak lies inside the run, and its AICc is lower by 2 than that of the best
of three monotone curves. What moves by less than the returns' own errors is taken for standing still.

Source: Gao, Schulman & Hilton (2023), arXiv:2210.10760 (the form for reinforcement learning).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import minimize_scalar

from irl.core import statistics

LEAST_POINTS = 8
"""Points that a fit needs, after the first."""
MARGIN = 2.0
"""Of AICc, that the fit has to be better by."""
WINDOW = 5
MOVED = 0.1
"""Of what proxy and gold span over the run, that each must span in a window for ranks to mean anything."""
SURE = 2.0
"""Standard errors that a change must exceed."""
FORM = "d (alpha - beta log d), d = sqrt(step / last step)"

Points = Float[np.ndarray, "N"]


@dataclass(frozen=True)
class Fit:
    """gold(d) - gold(0) = d (alpha - beta log d)."""

    alpha: float
    beta: float
    gain: float
    """By how much its AICc is lower than that of the best monotone curve."""

    @property
    def peak(self) -> float:
        """d*, of the last step's 1."""
        return math.exp(self.alpha / self.beta - 1.0)


@dataclass(frozen=True)
class Overoptimisation:
    """What a run did to its gold return; NaN where it is undefined."""

    peak: int
    """Which point has the highest gold return."""
    drop: float
    """Share of what was gained that was lost again; 0 for what is within errors; NaN if nothing was."""
    lost: float
    """The same of what lies above a floor: a first policy that happens to be good makes any gain small."""
    gap: float
    proxy_rose: bool | None
    """Whether the proxy at the end is above that at the peak of gold; None where errors do not say."""
    decoupling: int | None
    """The point where the first window begins; None where none does."""
    fit: Fit | None
    fit_reason: str | None
    """Why there is no fit."""


def overoptimisation(
    steps: Int[np.ndarray, "N"],
    proxy: Points,
    gold: Points,
    error: Points | None = None,
    floor: float | None = None,
    proxy_error: Points | None = None,
) -> Overoptimisation:
    """Peak, drop, gap, decoupling and fit of a curve.

    Args:
        steps: rising; the first is what the others are held against.
        error: standard error of each gold return; none unless given.
        floor: gold return of random actions; that of the first point unless given.
        proxy_error: standard error of each proxy return; none unless given.
    Raises:
        ValueError: there are fewer than two points, or a return is not finite.
    """
    if len(steps) < 2 or not (np.isfinite(proxy).all() and np.isfinite(gold).all()):
        raise ValueError(f"proxy and gold of {len(steps)} points; two or more finite ones are needed")
    error = np.zeros(len(gold)) if error is None else error
    proxy_error = np.zeros(len(gold)) if proxy_error is None else proxy_error
    peak = int(np.argmax(gold))
    fit, reason = fitted(steps, gold)
    return Overoptimisation(
        peak=peak,
        drop=_lost(gold, error, peak, float(gold[0])),
        lost=_lost(gold, error, peak, float(gold[0]) if floor is None else floor),
        gap=_z(proxy) - _z(gold),
        proxy_rose=_rose(proxy, proxy_error, peak),
        decoupling=decoupling(proxy, gold, error),
        fit=fit,
        fit_reason=reason,
    )


def _rose(proxy: Points, error: Points, peak: int) -> bool | None:
    """Whether the end is above the proxy at gold's peak; None where their errors do not say."""
    change = float(proxy[-1] - proxy[peak])
    return change > 0 if abs(change) > SURE * math.hypot(error[peak], error[-1]) else None


def _lost(gold: Points, error: Points, peak: int, floor: float) -> float:
    """Share of the peak above `floor` that the end lacks."""
    rise, fall = float(gold[peak]) - floor, float(gold[peak] - gold[-1])
    if rise <= SURE * math.hypot(error[peak], error[0]):
        return math.nan
    return fall / rise if fall > SURE * math.hypot(error[peak], error[-1]) else 0.0


def decoupling(proxy: Points, gold: Points, error: Points) -> int | None:
    """The point where the first window with Spearman(proxy, gold) <= 0 begins.

    A window in which either moves by less than a tenth of what it does over the run, or gold by less than
    its errors, is none: on a plateau, and before anything is learned, ranks are chance.
    """
    for start in range(len(gold) - WINDOW + 1):
        inside = slice(start, start + WINDOW)
        noise = 2 * SURE * math.sqrt(float(np.mean(error[inside] ** 2)))
        moved = all(np.ptp(of[inside]) > MOVED * np.ptp(of) for of in (proxy, gold))
        if not moved or np.ptp(gold[inside]) <= noise:
            continue
        # NaN where either stands still
        if statistics.spearman(proxy[inside], gold[inside]) <= 0:
            return start
    return None


def fitted(steps: Int[np.ndarray, "N"], gold: Points) -> tuple[Fit | None, str | None]:
    """The fit, or why it is refused."""
    d, y = np.sqrt(steps[1:] / steps[-1]), gold[1:] - gold[0]
    if len(y) < LEAST_POINTS:
        return None, f"{len(y)} points after the first; a fit needs {LEAST_POINTS}"
    if statistics.is_constant(y):
        return None, "the gold return stands still"
    design = np.column_stack([d, -d * np.log(d)])
    alpha, beta = np.linalg.lstsq(design, y, rcond=None)[0].tolist()
    gain = min(monotone(d, y)) - aicc(y - design @ [alpha, beta], 2)
    if beta <= 0 or not d[0] < math.exp(min(alpha / beta - 1.0, 1.0)) < 1.0:
        return None, "it has no peak inside the run: a monotone curve says as much"
    if not gain > MARGIN:
        return None, f"its AICc is not {MARGIN:g} below that of a monotone curve ({gain:+.1f})"
    return Fit(alpha, beta, gain), None


def monotone(d: Points, y: Points) -> tuple[float, float, float]:
    """AICc of a d, of a d^p and of a (1 - exp(-d / t)), each at its least squares."""

    def left(shape: Points) -> Points:
        return y - shape * (shape @ y) / (shape @ shape)

    def best(family) -> float:
        found = minimize_scalar(
            lambda u: float(np.sum(left(family(math.exp(u))) ** 2)), bounds=(-5.0, 3.0), method="bounded"
        )
        return aicc(left(family(math.exp(found.x))), 2)  # pyright: ignore[reportAttributeAccessIssue]

    return aicc(left(d), 1), best(lambda p: d**p), best(lambda t: 1.0 - np.exp(-d / t))


def aicc(residuals: Points, parameters: int) -> float:
    """N log(RSS / N) + 2 k + 2 k (k + 1) / (N - k - 1), with k the parameters and the variance."""
    n, k = len(residuals), parameters + 1
    # an exact fit has no logarithm
    spread = max(float(np.mean(residuals**2)), np.finfo(float).tiny)
    return n * math.log(spread) + 2 * k + 2 * k * (k + 1) / (n - k - 1)


def _z(values: Points) -> float:
    """How many standard deviations above the mean the last one is."""
    if statistics.is_constant(values):
        return math.nan
    return float((values[-1] - values.mean()) / values.std())


def standard_errors(returns: Sequence[Float[np.ndarray, "_"]]) -> Points:
    """Of each mean; 0 where there is one value alone."""
    return np.array([r.std(ddof=1) / math.sqrt(len(r)) if len(r) > 1 else 0.0 for r in returns])
