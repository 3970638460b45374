"""The `episodes` of evaluation.json: two episodes of the policy, each step's rewards, and pictures of them.

`irl evaluate` has played them already; the pictures are drawn by a process of its own (irl.envs.film) and are
left out, with the reason, where nothing can draw.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from irl.core.types import Episode, from_episodes
from irl.diagnostics.stack import Given, read
from irl.envs.film import film
from irl.envs.make import make
from irl.experiment.judge import finite
from irl.experiment.pictured import rounded

FOLDER = "episodes"


def record(
    run: Path, env_id: str, episodes: Sequence[Episode], reward: Given, frames: int
) -> list[dict[str, Any]]:
    """The episode in the middle by its return, and the worst where that is another one.

    Args:
        frames: of an episode, at most; 0 draws none.
    """
    returns = np.array([episode.return_ for episode in episodes])
    order = np.argsort(returns, kind="stable")
    middle, worst = episodes[order[(len(order) - 1) // 2]], episodes[order[0]]
    chosen = {"middle": middle} | ({"worst": worst} if worst is not middle else {})
    dt = _dt(env_id)
    return [
        _traces(name, episode, reward, dt) | _filmed(run, env_id, name, episode, frames)
        for name, episode in chosen.items()
    ]


def _traces(name: str, episode: Episode, reward: Given, dt: float | None) -> dict[str, Any]:
    return {
        "name": name,
        "seed": episode.seed,
        "steps": len(episode),
        "return": finite(episode.return_),
        "terminated": episode.terminated,
        "dt_s": dt,
        "learned": rounded(read(reward, from_episodes([episode]))),
        "hand_written": rounded(episode.reward),
        "terms": {term: rounded(values) for term, values in episode.terms.items()},
    }


def _filmed(run: Path, env_id: str, name: str, episode: Episode, frames: int) -> dict[str, Any]:
    if frames == 0:
        return {"film": None, "film_reason": "none was asked for: --frames 0"}
    sheet = run / FOLDER / f"{name}.webp"
    sheet.parent.mkdir(exist_ok=True)
    try:
        drawn = film(env_id, episode, frames, sheet)
    except RuntimeError as error:
        sheet.unlink(missing_ok=True)
        return {"film": None, "film_reason": str(error)}
    return {"film": {"file": f"{FOLDER}/{sheet.name}", **drawn}, "film_reason": None}


def _dt(env_id: str) -> float | None:
    """Seconds that a step lasts, where the environment says."""
    env = make(env_id)
    try:
        rate = env.metadata.get("render_fps")
        return 1.0 / float(rate) if rate else None
    finally:
        env.close()
