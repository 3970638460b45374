"""From rows, one a step, to episodes: where each begins, what follows its last step, why it ended.

Observations may be given in four ways. For N steps in E episodes:

    N rows, and next_observations      each step's own; they must be the next row's within an episode
    N + E rows                         each episode with the one after its last step
    E x (T + 1) x O                    the same, in episodes of one length
    N rows, or E x T x O               the last row of an episode is only an observation: its action, and why
                                       the episode ended there, are left out
"""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from irl.core.errors import UserError
from irl.demos.episodes import Columns
from irl.demos.sources import NAMES, Source

CLOSE = 1e-5
"""How far a next observation may be from the next row, beside the rounding of float32."""
NO_REASONS = (
    "nothing says why episodes end: all count as cut off by a time limit; an array `terminals` says where "
    "the task ended them"
)
_FLAGS = ("terminated", "truncated", "starts")
_COUNTS = ("episode", "step")
_ONE_EACH = ("rewards", *_FLAGS, *_COUNTS)


@dataclass(frozen=True)
class Split:
    """The columns of each episode, and what was left out of the file."""

    episodes: list[Columns]
    notes: tuple[str, ...]


def split_episodes(source: Source) -> Split:
    """The episodes of a file's rows, in their order.

    Rewards that were not recorded are NaN; actions that were not, have no column.

    Raises:
        UserError: arrays of different lengths, no borders, a flag that is not 0 or 1, or rows out of order;
            names episode and step, or the row.
    """
    _check_values(source.arrays)
    source = _flattened(source)
    arrays, n = source.arrays, _steps(source.arrays)
    for name, values in {**arrays, **source.infos}.items():
        if name != "obs" and len(values) != n:
            raise UserError(f"it has {len(values)} rows of {name} for {n} steps; expected one each")
        if name in _ONE_EACH and values.size != n:
            raise UserError(f"it has {name} of shape {values.shape}; expected one number a step")
    if n == 0:
        raise UserError("it has no rows; expected at least one step")
    arrays = {name: values.reshape(n) if name in _ONE_EACH else values for name, values in arrays.items()}
    source = replace(source, arrays=arrays)
    bounds = _bounds(arrays, n)
    _check_order(arrays, bounds)
    observations, dropped = _observations(arrays, n, bounds)
    notes = []
    if dropped:
        notes.append(_left_out(arrays, bounds))
        bounds = [(start, stop - 1) for start, stop in bounds]
    if not {"terminated", "truncated"} & arrays.keys():
        notes.append(NO_REASONS)
    if source.unused:
        notes.append(f"not used: {', '.join(source.unused)}")
    episodes = [
        _columns(source, obs, start, stop, dropped)
        for obs, (start, stop) in zip(observations, bounds, strict=True)
    ]
    return Split(episodes, tuple(notes))


def _check_values(arrays: Mapping[str, np.ndarray]) -> None:
    """Refuse flags, episodes and steps that say nothing: NaN, true and equal to none, would end episodes."""
    for name in (*_FLAGS, *_COUNTS):
        values = arrays.get(name, np.zeros(0))
        good = (values == 0) | (values == 1) if name in _FLAGS else np.isfinite(values)
        if not good.all():
            row, *column = place = tuple(int(i) for i in np.argwhere(~good)[0])
            where = f"row {row}, column {column[0]}," if column else f"row {row}"
            expected = "0 or 1" if name in _FLAGS else "a finite number"
            raise UserError(
                f"it has {values[place]:g} in {where} of {name} (the array {' or '.join(NAMES[name])}); "
                f"expected {expected} for each step"
            )


def _left_out(arrays: Mapping[str, np.ndarray], bounds: list[tuple[int, int]]) -> str:
    lasts = [stop - 1 for _, stop in bounds]
    lost = int((arrays["terminated"][lasts] > 0).sum()) if "terminated" in arrays else 0
    of = f"{len(bounds)} actions and " if "actions" in arrays else ""
    return (
        f"without next observations the last row of each of the {len(bounds)} episodes is only an "
        f"observation: {of}{lost} terminations are left out"
    )


def _flattened(source: Source) -> Source:
    """The same with the episodes of one length, an axis of their own, one after the other."""
    arrays = dict(source.arrays)
    if (obs := arrays["obs"]).ndim != 3:
        return source
    count = len(obs)
    length = next((len(v[0]) for k, v in arrays.items() if k != "obs" and v.ndim > 1 and count), obs.shape[1])
    if any(len(values) != count for values in arrays.values()):
        sizes = ", ".join(f"{name} {len(values)}" for name, values in arrays.items())
        raise UserError(
            f"its observations are in {count} episodes; expected the same of every array, not {sizes}"
        )
    for name, values in arrays.items():
        if values.ndim == 1:
            # one for each episode: it is about the last step
            arrays[name] = np.zeros((count, length), values.dtype)
            arrays[name][:, -1] = values
        arrays[name] = arrays[name].reshape(-1, *values.shape[2:])
    arrays["episode"] = np.arange(count).repeat(length)
    infos = {
        k: v.reshape(-1, *v.shape[2:]) for k, v in source.infos.items() if v.shape[:2] == (count, length)
    }
    return replace(source, arrays=arrays, infos=infos)


def _steps(arrays: Mapping[str, np.ndarray]) -> int:
    others = [len(values) for name, values in arrays.items() if name != "obs" and values.ndim]
    return others[0] if others else len(arrays["obs"])


def _bounds(arrays: Mapping[str, np.ndarray], n: int) -> list[tuple[int, int]]:
    """First row of each episode, and the one after its last."""
    if "episode" in arrays:
        ids = arrays["episode"]
        ends = np.flatnonzero(ids[1:] != ids[:-1])
        firsts = [ids[0], *ids[ends + 1]]
        for k, name in enumerate(firsts):
            if name in firsts[:k]:
                row = ([0, *(ends + 1)])[k]
                raise UserError(
                    f"episode {name} goes on in row {row}, after episode {firsts[k - 1]}; sort the rows by "
                    f"episode and step"
                )
    elif "starts" in arrays:
        ends = np.flatnonzero(arrays["starts"][1:].astype(bool))
    elif flags := [arrays[name].astype(bool) for name in ("terminated", "truncated") if name in arrays]:
        ends = np.flatnonzero(np.logical_or.reduce(flags))
        ends = ends[ends < n - 1]
    else:
        raise UserError(
            "nothing in it says where episodes end; expected terminals (the task ended it) and timeouts (a "
            "time limit did), or episode_ids. dones alone do not say which"
        )
    cuts = [0, *(int(end) + 1 for end in ends), n]
    return list(itertools.pairwise(cuts))


def _check_order(arrays: Mapping[str, np.ndarray], bounds: list[tuple[int, int]]) -> None:
    if (steps := arrays.get("step")) is None:
        return
    for index, (start, stop) in enumerate(bounds):
        wrong = np.flatnonzero(np.diff(steps[start:stop]) != 1)
        if len(wrong):
            at = start + int(wrong[0])
            raise UserError(
                f"episode {index} goes from step {steps[at]:g} to step {steps[at + 1]:g} in row {at + 1}; "
                f"expected {steps[at] + 1:g}: sort the rows by episode and step, or mark where episodes end"
            )


def _observations(
    arrays: Mapping[str, np.ndarray], n: int, bounds: list[tuple[int, int]]
) -> tuple[list[np.ndarray], bool]:
    """T + 1 observations for T steps of each episode, and whether its last row was taken for that."""
    obs, after = arrays["obs"], arrays.get("next_obs")
    if obs.ndim == 1:
        obs = obs[:, None]
    if len(obs) == n + len(bounds) and after is None:
        return [obs[start + i : stop + i + 1] for i, (start, stop) in enumerate(bounds)], False
    if len(obs) != n:
        raise UserError(
            f"it has {len(obs)} observations for {n} steps in {len(bounds)} episodes; expected {n}, or with "
            f"the one after each last step {n + len(bounds)}"
        )
    if after is None:
        for index, (start, stop) in enumerate(bounds):
            if stop - start < 2:
                raise UserError(
                    f"episode {index} is one row and its next observation is not known; leave it away, or "
                    f"give next_observations"
                )
        return [obs[start:stop] for start, stop in bounds], True
    after = after.reshape(n, -1)
    if after.shape != obs.shape:
        raise UserError(f"it has next_observations of {after.shape} and observations of {obs.shape}")
    for index, (start, stop) in enumerate(bounds):
        _check_next(index, obs[start + 1 : stop], after[start : stop - 1])
    return [np.concatenate([obs[start:stop], after[stop - 1 : stop]]) for start, stop in bounds], False


def _check_next(index: int, following: np.ndarray, said: np.ndarray) -> None:
    close = np.isclose(said, following, rtol=CLOSE, atol=CLOSE)
    if not close.all():
        step, column = (int(i) for i in np.argwhere(~close)[0])
        raise UserError(
            f"episode {index} has {said[step, column]:g} in column {column} of the next observation at step "
            f"{step}, and {following[step, column]:g} at step {step + 1}; the rows are out of order, or an "
            f"episode ends there and is not marked"
        )


def _columns(source: Source, obs: np.ndarray, start: int, stop: int, cut: bool) -> Columns:
    arrays, steps = source.arrays, stop - start

    def of(name: str, fill: float) -> np.ndarray:
        return arrays[name][start:stop] if name in arrays else np.full(steps, fill)

    actions = arrays["actions"][start:stop] if "actions" in arrays else np.zeros((steps, 0))
    terminated, truncated = of("terminated", 0.0) > 0, of("truncated", 0.0) > 0
    if cut:
        # a flag on an earlier row is a mistake that is found later; this end is the recording's
        truncated = np.append(truncated[:-1], True)
    return Columns(
        obs.astype(np.float64),
        actions,
        of("rewards", np.nan).astype(np.float64),
        terminated,
        truncated,
        infos={name: values[start:stop] for name, values in source.infos.items()},
    )
