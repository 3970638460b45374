"""What the page says about the run itself: how it was made, and every setting of it."""

import re
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from irl.report.citations import METHODS
from irl.report.folder import RunFiles, lookup, number, texts
from irl.report.summary import summary

CHIEF_PACKAGES = ("irl", "torch", "stable-baselines3", "gymnasium", "mujoco", "numpy")


def header(run: RunFiles) -> str:
    """Name, method, task, steps and demonstrations, the sentences to remember, and how to repeat the run."""
    evaluation, config, environment = run.evaluation, run.config, run.environment
    kind = evaluation.get("method") or config.get("kind") or "unknown method"
    task = evaluation.get("env_id") or config.get("env_id") or "unknown task"
    steps = number(evaluation, "env_steps")
    if steps is None:
        steps = max((number(row, "env_steps") or 0.0 for row in run.metrics), default=0.0)
    facts = {
        "Seed": config.get("seed"),
        "Command": _command(environment),
        "Code": _commit(environment),
        "Machine": _joined(environment.get("machine"), _device(environment)),
        "Versions": _versions(environment),
    }
    sentences = "".join(f"<li>{escape(sentence)}</li>" for sentence in summary(run))
    return (
        f"<header><h1>{escape(run.name)}</h1>"
        f'<p class="kind">{escape(_title(kind))} on {escape(str(task))}, {steps:,.0f} environment steps'
        f"{escape(_learned_from(run))}</p>"
        f'<ul class="lead">{sentences}</ul>{_facts(facts)}</header>'
    )


def head_of(runs: Sequence[RunFiles]) -> str:
    """The title of a page of several runs."""
    names = ", ".join(run.name for run in runs)
    return f'<header><h1>{len(runs)} runs</h1><p class="kind">{escape(names)}</p></header>'


def notes(run: RunFiles, prefix: str = "") -> str:
    """What the evaluation and the reading of the files had to say."""
    parts = [lookup(run.evaluation, part) for part in ("policy", "reward", "distances", "drift")]
    found = [note for part in (*parts, run.evaluation) for note in texts(lookup(part, "notes"))]
    found += run.problems.values()
    if not found:
        return ""
    items = "".join(f"<li>{escape(note)}</li>" for note in dict.fromkeys(found))
    return f'<section id="{prefix}notes" data-section="notes"><h2>Notes</h2><ul>{items}</ul></section>'


def _title(kind: object) -> str:
    """A method as its paper writes it."""
    name = str(kind)
    return METHODS[name][0] if name in METHODS else name


def _learned_from(run: RunFiles) -> str:
    """How many demonstrations there were, and of what dataset."""
    episodes = number(run.evaluation, "references.demonstrations.episodes")
    if episodes is None:
        episodes = number(run.config, "demo_episodes")
    source = run.config.get("demos") or lookup(run.evaluation, "references.demonstrations.source")
    if episodes is None:
        return ""
    of = f" of {source}" if isinstance(source, str) else ""
    return f", learned from {episodes:.0f} demonstration{'s' * (episodes != 1)}{of}"


def _command(environment: Mapping[str, Any]) -> str | None:
    """As it was typed; Python calls a program that was started by `python -c` just `-c`."""
    command = environment.get("command")
    return re.sub(r"^-[cm] ", "irl ", str(command)) if command else None


def _commit(environment: Mapping[str, Any]) -> str | None:
    commit = environment.get("git_commit")
    if not commit:
        return None
    resumed = environment.get("resumed")
    rows = resumed if isinstance(resumed, list) else []
    later = [row.get("git_commit") for row in rows if isinstance(row, Mapping)]
    said = [
        f"commit {str(commit)[:10]}" + (" with uncommitted changes" if environment.get("git_dirty") else "")
    ]
    return ", then ".join([*said, *(str(one)[:10] for one in later if one)])


def _device(environment: Mapping[str, Any]) -> str | None:
    threads = environment.get("threads")
    return _joined(environment.get("device"), f"{threads} threads" if threads is not None else None)


def _versions(environment: Mapping[str, Any]) -> str | None:
    packages = environment.get("packages")
    known = packages if isinstance(packages, Mapping) else {}
    chief = [f"{name} {known[name]}" for name in CHIEF_PACKAGES if name in known]
    python = environment.get("python")
    return _joined(f"Python {python}" if python else None, *chief)


def _joined(*parts: object) -> str | None:
    return ", ".join(str(part) for part in parts if part) or None


def _facts(facts: Mapping[str, object]) -> str:
    rows = (
        f"<dt>{escape(name)}</dt><dd>{escape(str(value))}</dd>"
        for name, value in facts.items()
        if value is not None
    )
    return f'<dl class="facts">{"".join(rows)}</dl>'


def settings(run: RunFiles) -> str:
    """All settings and package versions, folded away."""
    packages = run.environment.get("packages")
    groups = {"Settings of the run": run.config, "All package versions": packages}
    return "".join(
        f"<details><summary>{title}</summary>{_facts(_flat(values))}</details>"
        for title, values in groups.items()
        if isinstance(values, Mapping) and values
    )


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    flat: dict[str, object] = {}
    for key, value in values.items():
        flat |= (
            _flat(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {f"{prefix}{key}": str(value)}
        )
    return flat
