"""`irl.diagnose`: a reward from anywhere held against another one on a probe.

>>> import irl
>>> probe = irl.load_probe("hopper.npz")                                          # doctest: +SKIP
>>> print(irl.diagnose(lambda batch: batch.obs[:, 5], irl.HandWritten(), probe))  # doctest: +SKIP
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float

from irl.core.errors import UserError
from irl.core.types import Episode
from irl.diagnostics import compare, references, val
from irl.diagnostics.distance import Distance
from irl.diagnostics.stack import Given, Stack, read, stack
from irl.rewards.mujoco import HandWritten

FEW_EPISODES = 5
"""A stratum of fewer episodes says little by itself."""


@dataclass(frozen=True)
class Stratum:
    """The distance within one kind of play."""

    distance: Distance
    steps: int
    episodes: int

    @property
    def covered(self) -> bool:
        """Whether there are episodes enough to read it by itself."""
        return self.episodes >= FEW_EPISODES


@dataclass(frozen=True)
class Diagnosis:
    """How far a reward is from another one."""

    headline: Distance
    """VAL over 50 steps, or the longest segment below that the episodes have room for."""
    curve: tuple[Distance, ...]
    """VAL over segments of 1, 10, 50, 100 steps and whole episodes."""
    references: tuple[Distance, ...]
    """The distances that were asked for by name."""
    strata: Mapping[str, Stratum]
    """The headline's distance within each kind of play."""
    steps: int
    episodes: int
    gamma: float

    def __str__(self) -> str:
        rows = [_line(d) for d in (*self.curve, *self.references)]
        head = f"{'distance':<18}{'':>20}  {'95 %':>13}  {'own error':>9}  {'random':>6}"
        within = [
            f"  within {name}: {s.distance.shown}" + ("" if s.covered else f", {s.episodes} episodes: few")
            for name, s in self.strata.items()
        ]
        counted = f"{self.steps} steps of {self.episodes} episodes, gamma {self.gamma:g}"
        return "\n".join([counted, head, *rows, *within])


def diagnose(
    reward: Given,
    truth: Given,
    probe: Mapping[str, Sequence[Episode]] | Sequence[Episode],
    *,
    gamma: float = 0.99,
    ns: Sequence[int] = val.CURVE,
    named: Sequence[str] = (),
    seed: int = 0,
) -> Diagnosis:
    """The distances between `reward` and `truth` on the steps of a probe, with what they can tell apart.

    Args:
        reward: a function of `Transitions` that gives one number a step; a tensor or an array.
        truth: what it is held against, e.g. `irl.HandWritten()`, which reads the recorded reward.
        probe: whole episodes by kind of play, or just episodes. Near-deterministic policies alone do not
            do: without action noise what is left of a reward is noise.
        gamma: the learner's discount, per step.
        ns: steps of a segment; 0 is whole episodes.
        named: of `irl.diagnostics.references.NAMES`.
        seed: draws features, self-tests and resamples.
    Raises:
        UserError: no such named distance, or EPIC of a reward that is recorded and no function.
        ValueError: a reward does not give one number a step, or there is no episode.
    Cost: seconds for 100,000 steps; `epic` three million rewards more.
    """
    _check_named(named, truth)
    strata = probe if isinstance(probe, Mapping) else {"episodes": probe}
    steps = stack(strata)
    own, learned = read(truth, steps.batch), read(reward, steps.batch)
    of = compare.columns(own, learned[:, None], steps, gamma, seed)
    left = val.canonical(of, seed)
    curve = tuple(val.distances(left, n, seed)[0] for n in ns)
    n = val.longest(steps.layout, ns)
    headline = next((d for d in curve if d.n == n), None) or val.distances(left, n, seed)[0]
    found = tuple(
        references.of_functions(truth, [reward], of, seed)[0]
        if name == "epic"
        else references.of_steps(name, of, seed)[0]
        for name in named
    )
    return Diagnosis(
        headline=headline,
        curve=curve,
        references=found,
        strata={name: within(left, name, n, seed) for name in steps.layout.names},
        steps=len(steps.batch),
        episodes=len(steps.layout.length),
        gamma=gamma,
    )


def within(left: val.Canonical, name: str, n: int, seed: int) -> Stratum:
    """VAL_n of the first reward asked about, over the segments of one stratum."""
    layout = left.columns.steps.layout
    episodes = int(np.sum(layout.stratum == layout.names.index(name)))
    part = _only(left, name)
    steps = len(part.errors)
    return Stratum(val.distances(part, n, seed)[0], steps, episodes)


def _only(left: val.Canonical, name: str) -> val.Canonical:
    steps = left.columns.steps
    chosen = steps.of(name)
    part = _cut(steps, name, chosen)
    raw: Float[np.ndarray, "N R"] = left.columns.raw[chosen]
    return val.Canonical(replace(left.columns, raw=raw, steps=part), left.errors[chosen])


def _cut(steps: Stack, name: str, chosen: Bool[np.ndarray, "N"]) -> Stack:
    layout = steps.layout
    kept = layout.stratum == layout.names.index(name)
    length = layout.length[kept]
    cut = replace(
        layout,
        start=np.cumsum(length) - length,
        length=length,
        terminated=layout.terminated[kept],
        stratum=np.zeros(len(length), dtype=np.int64),
        names=(name,),
    )
    return Stack(steps.batch[torch.from_numpy(chosen)], cut)


def _check_named(named: Sequence[str], truth: Given) -> None:
    if unknown := sorted(set(named) - set(references.NAMES)):
        raise UserError(
            f"no distance is called {', '.join(unknown)}; choose of {', '.join(references.NAMES)}"
        )
    if "epic" in named and isinstance(truth, HandWritten):
        raise UserError(
            "EPIC asks for the reward of steps that were never made, and the hand-written one is known where "
            "it was recorded only; give a function as truth, e.g. irl.rewards.velocity.of_task('Hopper-v5')"
        )


def _line(d: Distance) -> str:
    of_segments = {None: "", 0: ", whole episodes"}
    name = d.name + of_segments.get(d.n, f", n = {d.n}")
    if d.reason:
        return f"{name:<22}{'undefined':>16}  {d.reason}"
    shown = f"{d.value:.3f}" if d.distinguishable is not False else "not distinguishable"
    return f"{name:<18}{shown:>20}  {d.low:.3f}-{d.high:.3f}   {d.self_error:>9.3f}  {d.random:>6.3f}"
