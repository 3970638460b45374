"""What a retrained policy is worth: the task's own return beside the learned one, over the same episodes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from irl.core import files
from irl.core.records import RunFolder
from irl.core.rng import episode_seeds
from irl.core.types import Episode
from irl.diagnostics.stack import read_episodes
from irl.envs.rollouts import rollouts
from irl.experiment.configs import RetrainRun
from irl.experiment.frozen import RECORD
from irl.experiment.judge import finite
from irl.experiment.overoptimised import over_run
from irl.experiment.play import EVALUATION, evaluated
from irl.experiment.progress import each_episode, progress
from irl.experiment.references import why_unscored
from irl.policies import shelf
from irl.policies.card import Card, normalised_score, summary
from irl.policies.policy import load_policy
from irl.rewards.learned import LearnedReward

EPISODES = 20
"""Episodes of the deterministic policy, whose starts no training and no other evaluation has."""

RESULT = "retrain.json"


def report(config: RetrainRun, folder: RunFolder, reward: LearnedReward, policies_root: Path | None) -> None:
    """Play the last snapshot's policy, write `retrain.json`, print a table."""
    steps, last = list(folder.snapshots().items())[-1]
    policy = load_policy(last / "policy.safetensors")
    seeds = episode_seeds(config.seed, "retrained", EPISODES)
    with progress(f"measuring {config.env_id}", EPISODES, show=config.watch.progress) as done:
        episodes = rollouts(config.env_id, policy, seeds, each_episode(done))
    card = shelf.expert_card(config.env_id, policies_root)
    result = {
        "format": "irl.retrain",
        "version": 1,
        "env_id": config.env_id,
        "reward": files.read_json(folder.path / RECORD),
        "algorithm": config.learner.KIND,
        "seed": config.seed,
        "env_steps": steps,
        "true": _true(episodes, card),
        "learned": _learned(reward, episodes),
        "proxy_gold": _over_training(config, folder, reward, card.random_return_mean if card else None),
        "episodes": EPISODES,
        "episode_seeds": seeds,
    }
    files.write_json(folder.path / RESULT, result)
    Console().print(_table(result))


def _over_training(
    config: RetrainRun, folder: RunFolder, reward: LearnedReward, floor: float | None
) -> dict[str, Any]:
    """Both returns from random weights on, at the evaluations: here the proxy is one reward all along."""
    names = ("env_steps", "eval_learned_return_mean", "eval_return_mean", "eval_return_stderr")
    n, rows = config.watch.eval_episodes, folder.metrics()
    if n:
        # of the policy that nothing had taught yet
        step, first = next(iter(folder.snapshots().items()))
        policy, seeds = load_policy(first / "policy.safetensors"), episode_seeds(config.seed, EVALUATION, n)
        rows = [{"env_steps": step, **evaluated(config.env_id, policy, seeds, reward)}, *rows]
    columns = [[row.get(name) for name in names] for row in rows]
    known = [row for row in columns if None not in row]
    steps, proxy, gold, error = zip(*known, strict=True) if known else ((), (), (), ())
    return over_run(steps, proxy, gold, np.array(error, float), floor=floor)[0]


def _true(episodes: Sequence[Episode], card: Card | None) -> dict[str, Any]:
    """Returns by the task's own reward, and what they are of the expert's."""
    measured = summary(list(episodes))
    references = (card.random_return_mean, card.measured.return_mean) if card else (None, None)
    score = normalised_score(measured.return_mean, *references)
    unscored = why_unscored(measured.return_mean, *references)
    return {
        "return_mean": finite(measured.return_mean),
        "return_std": finite(measured.return_std),
        "return_min": finite(measured.return_min),
        "normalised_score": finite(score),
        "normalised_score_reason": None if np.isfinite(score) else unscored,
        "random_return_mean": references[0],
        "expert_return_mean": references[1],
        "returns": [finite(value) for value in measured.returns],
        "length_mean": measured.length_mean,
        "lengths": list(measured.lengths),
    }


def _learned(reward: LearnedReward, episodes: Sequence[Episode]) -> dict[str, Any]:
    """Returns by the learned reward: undiscounted sums of what the steps pay above the absorbing state."""
    returns = np.array([float(given.sum()) for given in read_episodes(reward, episodes)])
    return {
        "return_mean": finite(float(returns.mean())),
        "return_std": finite(float(returns.std())),
        "return_min": finite(float(returns.min())),
        "returns": [finite(value) for value in returns.tolist()],
    }


def _table(result: dict[str, Any]) -> Table:
    reward, true = result["reward"], result["true"]
    of = f"the reward of {reward['run']} at step {reward['env_steps']}"
    of = f"the hand-written reward, judged by {of}" if reward.get("hand_written") else of
    learner = f"{result['algorithm']}, {result['env_steps']} steps"
    title = escape(f"{learner} on {of}; {result['episodes']} deterministic episodes")
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for column in ("return", "mean ± std", "worst", "score"):
        table.add_column(column, no_wrap=True)
    for name, score in (("true", true["normalised_score"]), ("learned", None)):
        row = result[name]
        spread = f"{_number(row['return_mean'])} ± {_number(row['return_std'])}"
        table.add_row(name, spread, _number(row["return_min"]), _number(score, 3))
    return table


def _number(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
