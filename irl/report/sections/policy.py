"""How well the policy does, beside expert, demonstrations and random play."""

from irl.report import plots
from irl.report.folder import RunFiles, column, number
from irl.report.panel import Panel, absent, one

REFERENCES = ("expert", "demonstrations", "random")


def policy(run: RunFiles) -> Panel:
    """Return against steps."""
    anchor, title = "policy", "Policy"
    measured = column(run.metrics, "env_steps", "return_mean")[0]
    evaluated = column(run.metrics, "env_steps", "eval_return_mean")[0]
    if not measured and not evaluated:
        reason = "no episode has finished yet, so there is no return"
        return absent(anchor, title, run.problems.get("metrics.jsonl", reason) if not run.metrics else reason)
    known = {who: number(run.evaluation, f"references.{who}.return_mean") for who in REFERENCES}
    references = {who: value for who, value in known.items() if value is not None}
    text = (
        "The return that the task pays and the learner never sees: the thin line is the exploring policy "
        "(return_mean)"
        + ("; the markers are the deterministic policy (eval_return_mean)" if evaluated else "")
        + ("; it should climb to the expert's line." if "expert" in references else ".")
    )
    return Panel(anchor, title, text, "return", one(plots.learning_curve(run.metrics, references)))
