"""`irl retrain RUN --seeds ...`: fresh policies of several seeds, and what they come to beside the run's own.

Each seed has a folder, as one alone has. RUN/retrained.json gathers them: a row for each snapshot, part of
the reward, dynamics and learner, to which later seeds are added.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from irl.core import files
from irl.core.config import from_json, to_json
from irl.core.differences import differences, without
from irl.core.errors import UserError
from irl.core.records import RunFolder, open_run
from irl.core.rng import episode_seeds, stream
from irl.core.statistics import iqm
from irl.diagnostics.retraining import retrain_ratio
from irl.envs.make import check_module
from irl.envs.names import split_name
from irl.envs.rollouts import rollouts
from irl.experiment.configs import Imitation, RetrainRun
from irl.experiment.frozen import RECORD, frozen, is_recorded, recorded
from irl.experiment.judge import finite
from irl.experiment.play import MAY_CHANGE
from irl.experiment.progress import each_episode, progress
from irl.experiment.retrain import LEARNERS, Retrain, retrain_one, settled
from irl.experiment.retrained import EPISODES, RESULT
from irl.experiment.snapshots import snapshot_of
from irl.policies import shelf
from irl.policies.card import measure_random
from irl.policies.policy import load_policy

GATHERED, FORMAT, VERSION = "retrained.json", "irl.retrained", 1
UNCHANGED, HAND_WRITTEN = "as trained", "hand-written"
KEY = ("snapshot", "part", "env_id", "algorithm", "env_steps", "settings")
"""What two retrainings have in common that are seeds of one row."""


def retrain(command: Retrain) -> None:
    """Train with one seed, or with several and gather them."""
    if not command.seeds:
        retrain_one(command)
        return
    assert command.run is not None
    source = open_run(command.run)
    files.check_writable(source.path / GATHERED)
    where = str(source.path / "config.json")
    its = from_json(Imitation, source.config, where)
    check_module(its.env_id, where)
    step, snapshot = snapshot_of(source, command.snapshot)
    one_by_one = [_one_of(command, its, step, seed) for seed in command.seeds]
    # every folder is looked at before anything is trained
    configs = [settled(one, its, step) for one in one_by_one]
    ahead = [_still_to_do(one, config, snapshot) for one, config in zip(one_by_one, configs, strict=True)]
    _rows(source.path / GATHERED)
    for one in ahead:
        if one is not None:
            retrain_one(one)
    results = [_result(config) for config in configs]
    tasks = its.env_id, configs[0].env_id
    with files.held(source.path / f".{GATHERED}.lock"):
        # read again: hours have passed, in which another command may have added its row
        before = _rows(source.path / GATHERED)
        row = gathered(before, results, tasks, snapshot, command.policies_root)
        rows = [old for old in before if not _is_same(old, row)] + [row]
        files.write_json(source.path / GATHERED, {"format": FORMAT, "version": VERSION, "rows": rows})
    Console().print(_said(row), highlight=False, markup=False, soft_wrap=True)


def gathered(
    before: Sequence[Mapping[str, Any]],
    results: Sequence[Mapping[str, Any]],
    tasks: tuple[str, str],
    snapshot: Path,
    root: Path | None,
) -> dict[str, Any]:
    """The row of these results, with the seeds that it had among the rows `before`.

    Args:
        results: of one snapshot, part, task and learner; each a retrain.json.
        tasks: where the reward was learned, and where they were trained.
        snapshot: whose policy is played there.
    """
    row = _empty_row(results[0], *tasks)
    same = [old for old in before if _is_same(old, row)]
    seeds = {s: r for old in same for s, r in zip(old["seeds"], old["episode_returns"], strict=True)}
    seeds |= {result["seed"]: result["true"]["returns"] for result in results}
    return _measured(row, dict(sorted(seeds.items())), snapshot, root)


def _rows(path: Path) -> list[dict[str, Any]]:
    """The rows of RUN/retrained.json; none where there is no file.

    Raises:
        UserError: it is not one that this version wrote.
    """
    if not path.is_file():
        return []
    content = files.read_json(path)
    known = isinstance(content, dict) and (content.get("format"), content.get("version")) == (FORMAT, VERSION)
    rows = content.get("rows") if known else None
    # settings have come later: a row without them is of nobody knows which, and no seed is added to it
    wanted = {*KEY, "seeds", "episode_returns"} - {"settings"}
    if not isinstance(rows, list) or not all(isinstance(r, dict) and wanted <= set(r) for r in rows):
        raise UserError(f"{path} is not a file that irl retrain --seeds writes; move it out of the way")
    return rows


def _result(config: RetrainRun) -> dict[str, Any]:
    content = files.read_json(path := config.out / RESULT)
    try:
        found = {"seed": int(content["seed"]), "true": {"returns": list(content["true"]["returns"])}}
        found["reward"] = {name: content["reward"][name] for name in ("env_steps", "reward_map")}
        found["reward"]["average_over"] = dict(content["reward"].get("average_over", {}))
        found["reward"]["hand_written"] = bool(content["reward"].get("hand_written"))
        found |= {"settings": {**to_json(config.learner), "entropy": config.entropy}}
        found |= {"changed": _changed(config)}
        return found | {name: content[name] for name in ("algorithm", "env_steps")}
    except (LookupError, TypeError, ValueError) as error:
        raise UserError(
            f"{path} is no result of irl retrain; take it away and it is measured again"
        ) from error


def _is_same(old: Mapping[str, Any], row: Mapping[str, Any]) -> bool:
    return all(old.get(key) == row[key] for key in KEY)


def _changed(config: RetrainRun) -> str:
    """The learner's settings that are not its defaults, in words."""
    given, usual = to_json(config.learner), to_json(LEARNERS[config.learner.KIND])
    words = [f"{name} {value}" for name, value in given.items() if value != usual[name]]
    return ", ".join(words + [f"entropy {config.entropy}"] * bool(config.entropy))


def _one_of(command: Retrain, its: Any, step: int, seed: int) -> Retrain:
    """The command of one seed, with its folder."""
    alone = replace(command, seeds=(), seed=seed, out=None)
    out = settled(alone, its, step).out
    return replace(alone, out=out if command.out is None else command.out / out.name)


def _still_to_do(command: Retrain, config: RetrainRun, snapshot: Path) -> Retrain | None:
    """The command that begins or goes on with a seed; None where it is done.

    Raises:
        UserError: its folder holds another retraining, or one on another reward.
    """
    folder = RunFolder(config.out)
    if not (folder.path / "config.json").is_file():
        return command
    # read, so that a setting that has come since then is what it was in effect
    before = to_json(from_json(RetrainRun, folder.config, str(folder.path / "config.json")))
    changed = differences(without(before, MAY_CHANGE), without(to_json(config), MAY_CHANGE))
    if changed:
        raise UserError(
            f"{folder.path} is a run with other settings: {'; '.join(changed):.300}; choose another --out"
        )
    reward = frozen(config, snapshot, command.part)
    # its settings name a run, and another may have had that name
    if not is_recorded(files.read_json(folder.path / RECORD), recorded(config, reward, snapshot)):
        raise UserError(
            f"{folder.path} is of another reward than {snapshot / 'reward'}; choose another --out, or take "
            f"it away"
        )
    if (folder.path / RESULT).is_file():
        return None
    return Retrain(resume=folder.path, policies_root=command.policies_root)


def _empty_row(result: Mapping[str, Any], learned: str, trained: str) -> dict[str, Any]:
    own, now = split_name(learned)[1], split_name(trained)[1]
    over = result["reward"].get("average_over", {})
    other = [f"{name}={value}" for name, value in sorted(now.items()) if own.get(name) != value]
    inner = [f"{k}={v}" for k, v in sorted(now.get("dynamics", {}).items())]
    words = [*[word for word in other if not word.startswith("dynamics=")], *inner]
    part = result["reward"]["reward_map"] + (f", mean of {len(over)}" if over else "")
    return {
        "snapshot": result["reward"]["env_steps"],
        "part": HAND_WRITTEN if result["reward"].get("hand_written") else part,
        "dynamics": " ".join(words) or UNCHANGED,
        "env_id": trained,
        "algorithm": result["algorithm"],
        "env_steps": result["env_steps"],
        "settings": result["settings"],
        "changed": result["changed"],
    }


def _measured(
    row: dict[str, Any], seeds: Mapping[int, list[float | None]], snapshot: Path, root: Path | None
) -> dict[str, Any]:
    """The row with its returns and their ratio to the policy of the snapshot, played in the same task."""
    env_id, card = row["env_id"], shelf.expert_card(row["env_id"], root)
    random = card.random_return_mean if card else measure_random(env_id, EPISODES).return_mean
    policy, starts = load_policy(snapshot / "policy.safetensors"), episode_seeds(0, "beside", EPISODES)
    with progress("the policy beside it", EPISODES) as report:
        beside = np.array([e.return_ for e in rollouts(env_id, policy, starts, each_episode(report))])
    returns = [np.array([np.nan if v is None else v for v in of]) for of in seeds.values()]
    means = [float(of.mean()) for of in returns]
    span = card.measured.return_mean - random if card else 0.0
    try:
        ratio, reason = asdict(retrain_ratio(returns, beside, random, stream(0, "retrain ratio"))), None
    except ValueError as failed:
        ratio, reason = dict.fromkeys(("value", "low", "high"), np.nan), str(failed)
    return {
        **row,
        "seeds": list(seeds),
        "returns": [finite(mean) for mean in means],
        "scores": [finite((mean - random) / span) if span else None for mean in means],
        "ratio": {name: finite(value) for name, value in ratio.items()},
        "ratio_reason": reason,
        "iqm": finite(iqm(np.array(means))),
        "beside": finite(float(beside.mean())),
        "random": finite(random),
        "episode_returns": [list(of) for of in seeds.values()],
    }


def _said(row: Mapping[str, Any]) -> str:
    ratio = row["ratio"]
    shown = "no ratio: " + str(row["ratio_reason"])
    if ratio["value"] is not None:
        shown = f"retrain ratio {ratio['value']:.2f}"
        if ratio["low"] is not None:
            shown += f" ({ratio['low']:.2f} to {ratio['high']:.2f})"
    returns = " ".join("-" if value is None else f"{value:.1f}" for value in row["returns"])
    where = f"{row['part']} of step {row['snapshot']:,}, {row['dynamics']}"
    where += f", {row['changed']}" if row["changed"] else ""
    return f"{where}: {shown}; returns {returns} of seeds {' '.join(map(str, row['seeds']))}"
