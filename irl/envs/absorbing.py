"""The absorbing state: what follows a termination, as a state that can be judged like any other.

    s_T -> s_abs,   s_abs -> s_abs -> ...       after a termination, never after a time limit

    R_T = r(s_T, a_T) + sum over t > T of gamma^(t - T) r(s_abs, 0)

An environment that stops at s_T leaves everything after it to be worth 0, whatever the learned rewards
are: a positive reward then pays for staying alive and a negative one for dying. Put into the data, s_abs
gets a learned reward of its own, and dying is worth what the expert makes of it.

s_abs is a row of zeros with a flag; a network that judges it sees the flag (`irl.rewards.nets`). In it the
action is 0.

Source: Kostrikov et al. (2019), arXiv:1809.02925, section 4.2.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Bool
from torch import Tensor

from irl.core.types import Episode, Transitions, concatenate, from_episodes


def absorb(batch: Transitions) -> Transitions:
    """The batch with its terminations led into s_abs, and a step s_abs -> s_abs for each at the end.

    A terminated step becomes s_T -> s_abs and is terminated no more: the task goes on there. Steps that a
    time limit ended stay as they are. The added steps have reward and terms 0. Absorbing twice is
    absorbing once.
    """
    ended = batch.terminated
    never = torch.zeros_like(ended)
    led = Transitions(
        obs=batch.obs,
        action=batch.action,
        next_obs=batch.next_obs.masked_fill(ended.unsqueeze(1), 0.0),
        terminated=never,
        truncated=batch.truncated,
        reward=batch.reward,
        terms=batch.terms,
        weight=batch.weight,
        absorbing=never if batch.absorbing is None else batch.absorbing,
        next_absorbing=ended if batch.next_absorbing is None else batch.next_absorbing | ended,
    )
    return concatenate([led, _loops(batch[ended])])


def _loops(ended: Transitions) -> Transitions:
    """s_abs -> s_abs, once for each of these steps."""
    never = torch.zeros_like(ended.terminated)
    return Transitions(
        obs=torch.zeros_like(ended.obs),
        action=torch.zeros_like(ended.action),
        next_obs=torch.zeros_like(ended.obs),
        terminated=never,
        truncated=never,
        reward=None if ended.reward is None else torch.zeros_like(ended.reward),
        terms={name: torch.zeros_like(term) for name, term in ended.terms.items()},
        weight=ended.weight,
        absorbing=~never,
        next_absorbing=~never,
    )


def subsample(
    episodes: Sequence[Episode], rate: int, rng: np.random.Generator, *, absorbing: bool = False
) -> Transitions:
    """Every `rate`-th step of each episode from an offset of its own; with `absorbing`, all of s_abs too.

        kept of an episode:   steps o, o + rate, o + 2 rate, ...,   o ~ U{0, ..., rate - 1}   weight 1
                              s_T -> s_abs and s_abs -> s_abs                                 weight 1 / rate

    Each step then weighs 1 / rate in expectation, and the end of an episode, of which there are few, is
    not lost. A kept step keeps its own next observation. An episode shorter than its offset leaves no
    step of weight 1. Without s_abs, or with rate 1, there is no weight column: all weigh 1.

    Args:
        rate: 1 keeps all.
        absorbing: lead terminations into s_abs first.
    Raises:
        ValueError: rate is below 1, there is no episode, or no step was kept.
    Source: the code of Kostrikov et al. (2019), google-research/dac, which keeps s_abs -> s_abs whatever
        the offset, and s_T -> s_abs as any other step, at weight 1.
    """
    if rate < 1:
        raise ValueError(f"rate must be at least 1, not {rate}")
    kept = concatenate([_thinned(episode, rate, int(rng.integers(rate)), absorbing) for episode in episodes])
    if not len(kept):
        raise ValueError(f"no step of {len(episodes)} episodes was kept at rate {rate}")
    return kept


def _thinned(episode: Episode, rate: int, offset: int, absorbing: bool) -> Transitions:
    batch = from_episodes([episode])
    if absorbing:
        batch = absorb(batch)
    always = _touches_absorbing(batch)
    on_grid = torch.arange(len(batch)) % rate == offset
    kept = batch[on_grid | always]
    if rate == 1 or not always.any():
        return kept
    weight = torch.ones(len(kept)).masked_fill(_touches_absorbing(kept), 1.0 / rate)
    return replace(kept, weight=weight)


def _touches_absorbing(batch: Transitions) -> Bool[Tensor, "B"]:
    if batch.absorbing is None or batch.next_absorbing is None:
        return torch.zeros_like(batch.terminated)
    return batch.absorbing | batch.next_absorbing
