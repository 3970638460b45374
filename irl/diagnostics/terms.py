"""Which terms of the hand-written reward a learned one pays for, and how much each.

    r  =  c  +  sum_k w_k T_k(s, a, s')  +  gamma (1 - terminated) theta . phi(s') - theta . phi(s)  +  e

Fitted jointly: a potential that the learned reward is shaped by is taken off first, or it would be booked on
the terms (Ng, Harada & Russell 1999: shaping changes no optimal policy). phi is the observations and their
squares; ridge on theta alone; every share is of episodes that the fit has not seen, and every interval is of
episodes drawn again within their stratum, since the steps of one are alike (bootstrap).

What cannot be known is said. A learned reward's scale means nothing: read weights beside each other. The
offset c and a term that pays for being alive are one quantity wherever an episode can end, because a constant
potential moves one into the other: w T + gamma c stays, the survival bonus.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from irl.core.statistics import is_constant
from irl.core.types import Episode
from irl.diagnostics import bootstrap
from irl.diagnostics.regression import condition, grams, redrawn, shapley, solve, unexplained
from irl.diagnostics.shaping import alive_value, column_of, design, moments

SHAPING = "shaping"
"""The potential, among the shares of what is explained."""
LEAST_SHARE = 1e-5
"""A term with less of the hand-written reward's variance is given no weight to believe."""
MOST_INFLATION = 100.0
"""Nor is one whose variance is explained to 99 % by the potential and the other terms."""


@dataclass(frozen=True)
class Weight:
    """What a term weighs in a learned reward."""

    weight: float
    """In units of the learned reward for a unit of the term."""
    low: float
    high: float
    """Where 95 % of sets of episodes put it, drawn again within their strata."""
    standardised: float
    """Weight times the term's deviation over the learned reward's: what it moves."""
    share: float
    """Shapley's share of the learned reward's variance, on episodes left out; all add up to `explained`."""
    variance_share: float
    """The term's variance over that of the hand-written reward."""
    inflation: float
    """By how much the others blow up its variance: 1 alone, infinite where they say all of it."""
    why_not: str | None
    """Why the weight cannot be believed; None where it can."""


@dataclass(frozen=True)
class Attribution:
    """The weights, and what they leave over."""

    terms: dict[str, Weight]
    explained: float
    """Share of the learned reward's variance, on episodes left out; 1 minus it is something else."""
    shaping: float
    """The potential's share of it."""
    survival_bonus: float
    """What a step is paid for not ending the episode, with gamma times the offset; NaN where none ends."""
    condition: float
    """Condition number of the standardised terms once the potential is taken off."""
    episodes: int


def attribute(
    episodes: Sequence[Episode],
    learned: Sequence[Float[np.ndarray, "_"]],
    *,
    stratum: Int[np.ndarray, "_"],
    gamma: float,
    rng: np.random.Generator,
    ridge: float = 1e-3,
    redraws: int = 200,
) -> Attribution:
    """Weights of the terms that every episode has recorded, in the reward `learned` of their steps.

    Args:
        stratum: of each episode the number of its kind of play; one number where there is one kind.
    Raises:
        ValueError: there are fewer than two episodes, they have no terms in common, the learned reward is of
            other steps or not finite, or the strata are not one an episode.
    Cost: 2^(terms + 1) times 5 small fits, and one for each of `redraws`.
    """
    if len(stratum) != len(episodes):
        raise ValueError(f"expected the stratum of each episode: {len(stratum)} != {len(episodes)}")
    names = names_of(episodes, learned)
    varying = [name for name in names if not is_constant(column_of(episodes, name))]
    mean, std = moments(episodes)
    of_episodes = grams([design(e, varying, gamma, mean, std) for e in episodes], learned)
    whole, k = of_episodes.sum(0), len(varying)
    potential, every = range(1 + k, len(whole) - 1), range(len(whole) - 1)
    shares, explained = shapley(of_episodes, k, potential, ridge)
    fitted = solve(whole, every, potential, ridge)
    drawn = redrawn(of_episodes, every, potential, ridge, bootstrap.within(stratum, redraws, rng))
    fit = _Fit(episodes, learned, whole, fitted, drawn, shares)
    found = {name: _weight(fit, name, 1 + i) for i, name in enumerate(varying)}
    return Attribution(
        terms={name: found.get(name) or _never(episodes, name) for name in names},
        explained=explained,
        shaping=float(shares[-1]),
        survival_bonus=_survival(fit, varying, gamma),
        condition=condition(whole, k, potential),
        episodes=len(episodes),
    )


@dataclass(frozen=True)
class _Fit:
    """What weights are read off."""

    episodes: Sequence[Episode]
    learned: Sequence[np.ndarray]
    whole: np.ndarray
    fitted: np.ndarray
    drawn: np.ndarray
    shares: np.ndarray


def names_of(episodes: Sequence[Episode], learned: Sequence[np.ndarray]) -> list[str]:
    """The terms that every episode has recorded.

    Raises:
        ValueError: there are fewer than two episodes or no such term, a term is not finite, or the learned
            reward is of other steps, constant or not finite.
    """
    if len(episodes) < 2:
        raise ValueError(f"weights and their intervals need two episodes or more, not {len(episodes)}")
    ours, theirs = [len(r) for r in learned], [len(e) for e in episodes]
    if ours != theirs:
        raise ValueError(f"expected a learned reward for each step: lengths {ours} != {theirs}")
    if not all(np.isfinite(r).all() for r in learned):
        raise ValueError("the learned reward is not finite everywhere")
    if is_constant(np.concatenate(learned)):
        raise ValueError("the learned reward is constant: no term has a part in it")
    names = [name for name in episodes[0].terms if all(name in episode.terms for episode in episodes)]
    if not names:
        raise ValueError("these episodes have no term of the hand-written reward in common")
    if broken := [name for name in names if not np.isfinite(column_of(episodes, name)).all()]:
        raise ValueError(f"recorded terms are not finite everywhere: {', '.join(broken)}")
    return names


def _weight(of: "_Fit", name: str, column: int) -> Weight:
    values = column_of(of.episodes, name)
    others = [i for i in range(of.whole.shape[0] - 1) if i != column]
    left = unexplained(of.whole, column, others)
    total = np.concatenate([sum(episode.terms.values()) for episode in of.episodes])
    share = float(np.var(values) / np.var(total)) if np.var(total) > 0.0 else math.nan
    inflation = 1.0 / left if left > 0.0 else math.inf
    low, high = np.quantile(of.drawn[:, column], [0.025, 0.975])
    return Weight(
        weight=float(of.fitted[column]),
        low=float(low),
        high=float(high),
        standardised=float(of.fitted[column] * np.std(values) / np.std(np.concatenate(of.learned))),
        share=float(of.shares[column - 1]),
        variance_share=share,
        inflation=inflation,
        why_not=_doubt(of.episodes, name, share, inflation),
    )


def _doubt(episodes: Sequence[Episode], name: str, share: float, inflation: float) -> str | None:
    if alive_value(episodes, name) is not None:
        return "it pays for being alive, which an offset does too: see the survival bonus"
    if share < LEAST_SHARE:
        return f"it is {share:.0e} of the hand-written reward's variance here"
    if inflation > MOST_INFLATION:
        return "the potential and the other terms say almost all of it"
    return None


def _never(episodes: Sequence[Episode], name: str) -> Weight:
    value, nan = float(episodes[0].terms[name][0]), math.nan
    return Weight(nan, nan, nan, nan, 0.0, 0.0, math.inf, f"it is {value:g} on every step here")


def _survival(of: "_Fit", names: Sequence[str], gamma: float) -> float:
    if not any(episode.terminated for episode in of.episodes):
        return math.nan
    bonus = gamma * float(of.fitted[0])
    for i, name in enumerate(names):
        if (value := alive_value(of.episodes, name)) is not None:
            bonus += float(of.fitted[1 + i]) * value
    return bonus
