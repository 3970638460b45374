"""`irl train ... --seeds 0-4`: the same run from several seeds, and what they come to together.

    OUT/s0  OUT/s1 ...    run folders as one seed makes them
    OUT/seeds.json        the last evaluation of each, their interquartile mean and its interval

One after the other in one process, each to the bit what it would be alone. Typed again, the command goes on
where it was stopped.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from irl.core import files
from irl.core.config import from_json, to_json
from irl.core.differences import differences, without
from irl.core.errors import UserError
from irl.core.records import RunFolder, open_run
from irl.core.rng import stream
from irl.core.statistics import iqm, iqm_interval
from irl.experiment.configs import FromDemonstrations
from irl.experiment.judge import finite
from irl.experiment.play import MAY_CHANGE
from irl.policies import shelf
from irl.policies.card import Card, normalised_score

SUMMARY = "seeds.json"
NOT_EVALUATED = "a run ended without an evaluation: it was begun with --watch.eval-episodes 0"
NOT_FINITE = "a return is not a finite number"
ONE_SEED = "one seed says nothing of another"


def train_seeds(
    config: FromDemonstrations,
    begin: Callable[[FromDemonstrations], None],
    go_on: Callable[[Path], None],
) -> None:
    """Begin each seed's run, or go on with it; then write and print the summary.

    Raises:
        UserError: a folder is there and is of other settings.
    """
    numbers, root = config.seed_numbers, config.folder_of_seeds
    runs = [replace(config, seed=seed, seeds="", out=root / f"s{seed}") for seed in numbers]
    begun = [run for run in runs if _is_there(run)]
    for run in runs:
        assert run.out is not None
        if run in begun:
            go_on(run.out)
        else:
            begin(run)
    result = summary(config, [open_run(root / f"s{seed}") for seed in numbers])
    files.write_json(root / SUMMARY, result)
    Console().print(table(result))
    Console().print(f"summary: {root / SUMMARY}", highlight=False, markup=False, soft_wrap=True)


def _is_there(run: FromDemonstrations) -> bool:
    assert run.out is not None
    if not (run.out / "config.json").is_file():
        return False
    # read, so that a setting that has come since then is what it was in effect
    read = from_json(FromDemonstrations, open_run(run.out).config, str(run.out / "config.json"))
    asked, there = to_json(run.resolved()), to_json(read)
    if changed := differences(without(there, MAY_CHANGE), without(asked, MAY_CHANGE)):
        raise UserError(
            f"{run.out} is there with other settings: {'; '.join(changed)}. Choose another folder with --out"
        )
    return True


def summary(config: FromDemonstrations, runs: Sequence[RunFolder]) -> dict[str, Any]:
    """What `seeds.json` holds: every seed singly, then the score, or where it is unknown the return."""
    env_id = config.resolved().env_id
    card = shelf.expert_card(env_id, None)
    if card is not None and card.random_return_mean == card.measured.return_mean:
        # between equal returns there is no scale
        card = None
    rows = [_row(run, seed, card) for run, seed in zip(runs, config.seed_numbers, strict=True)]
    played = sorted({row["evaluation_episodes"] for row in rows})
    measured = "score" if card is not None else "eval_return_mean"
    values = np.array([np.nan if row[measured] is None else row[measured] for row in rows])
    low, high = iqm_interval(values, stream(0, "seeds"))
    reason = ONE_SEED if len(values) < 2 else None
    if np.isnan(values).any():
        reason = NOT_FINITE if all(played) else NOT_EVALUATED
    return {
        "format": "irl.seeds",
        "version": 1,
        "method": config.KIND,
        "env_id": env_id,
        "evaluation_episodes": played[0] if len(played) == 1 else played,
        "measured": measured,
        "seeds": rows,
        "iqm": finite(iqm(values)),
        "interval_95": [finite(low), finite(high)],
        "interval_95_reason": reason,
    }


def _row(run: RunFolder, seed: int, card: Card | None) -> dict[str, Any]:
    """What `seeds.json` says of one seed."""
    last = run.metrics()[-1]
    value, score = last.get("eval_return_mean"), None
    if value is not None and card is not None:
        score = normalised_score(value, card.random_return_mean, card.measured.return_mean)
    # the run's own: one that was there already is not evaluated again with what is typed now
    begun = from_json(FromDemonstrations, run.config, str(run.path / "config.json"))
    return {
        "seed": seed,
        "run": run.path.name,
        "env_steps": last["env_steps"],
        "eval_return_mean": value,
        "evaluation_episodes": begun.watch.eval_episodes,
        "score": None if score is None else finite(score),
    }


def table(result: dict[str, Any]) -> Table:
    """The summary to print."""
    of = "normalised score" if result["measured"] == "score" else "return"
    drawn = Table(
        box=box.SIMPLE_HEAD, title=f"{result['method']} on {result['env_id']}", title_justify="left"
    )
    for name in ("seed", "steps", "return", "score"):
        drawn.add_column(name, justify="right")
    for row in result["seeds"]:
        shown = (_number(row["eval_return_mean"], 1), _number(row["score"], 3))
        drawn.add_row(str(row["seed"]), f"{row['env_steps']:,}", *shown)
    low, high = result["interval_95"]
    interval = f"[{low:.3f}, {high:.3f}]" if low is not None else result["interval_95_reason"]
    middle = "not known" if result["iqm"] is None else f"{result['iqm']:.3f}"
    drawn.caption = (
        f"interquartile mean of the {of}: {middle}, 95 % {interval}; last evaluation of each seed, "
        f"{_episodes(result['evaluation_episodes'])}"
    )
    return drawn


def _episodes(played: int | list[int]) -> str:
    if isinstance(played, int):
        return f"{played} episodes"
    return f"{' or '.join(map(str, played))} episodes, as each was begun ({SUMMARY} has it of each)"


def _number(value: float | None, digits: int) -> str:
    return "not known" if value is None else f"{value:.{digits}f}"
