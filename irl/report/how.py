"""How each number of the page is calculated, in the words of a person who has to check it."""

from html import escape

HOW: dict[str, tuple[str, str]] = {
    "return": (
        "Return",
        "The sum of the task's own reward over an episode, not discounted. In training: the mean of the last "
        "20 episodes of the exploring policy (return_mean). Evaluation: the deterministic policy on starts "
        "of its own (eval_return_mean). The normalised score is (return - random) / (expert - random). "
        "Source code: irl/experiment/evaluate.py.",
    ),
    "verdicts": (
        "Verdicts",
        "Each is one number held against one threshold, both shown on the card, with the rule in words. A "
        "verdict without a number is not known, which is not the same as not fired. Source code: "
        "irl/diagnostics/verdicts.py.",
    ),
    "moved": (
        "What moved",
        "Between two snapshots, on the same steps: E[(r' - r)²] = (μ' - μ)² [offset] + (σ' - σ)² [scale] + "
        "2 σ σ' (1 - ρ) [shape]. The three add up exactly. Only shape asks for other steps; an offset is a "
        "survival bonus where episodes can end early. Source code: irl/diagnostics/drift.py.",
    ),
    "discriminator": (
        "Discriminator health",
        "AUROC: how often an expert step has the higher logit than a fresh step of the snapshot's own "
        "policy; 0.5 is blind. Held-out demonstrations were not trained on. Accuracy is of the "
        "training batches, "
        "before each update. Source code: irl/diagnostics/health.py.",
    ),
    "fan": (
        "Reward fan",
        "Quantiles of each snapshot's reward on steps that are the same for every snapshot: the base probe's "
        "expert, medium, noisy expert and random play, and fresh steps of the final policy. Standardised: "
        "less the snapshot's mean over the base probe and over its deviation. Source code: "
        "irl/experiment/pictured.py.",
    ),
    "val": (
        "Distance of two rewards (VAL)",
        "A value function, fitted by least-squares temporal differences on fixed features, is taken off each "
        "reward: δ = r + γ V(s') - V(s). Discounted sums of δ over n steps are compared: D = "
        "√((1 - ρ) / 2), 0 the same, 1 the opposite. Shaping and positive scale do not count. The interval "
        "is over episodes, drawn again within each kind of play. The own error is what the computation finds "
        "between the hand-written reward and itself with random shaping: a distance below it says nothing. "
        "After Skalse et al. (2024), arXiv:2309.15257. Source code: irl/diagnostics/val.py.",
    ),
    "map": (
        "Snapshot map",
        "The VAL distance of every pair of snapshots and of each to the hand-written reward, for sums over n "
        "steps; the path is the placement in a plane whose distances are nearest to these (classical "
        "scaling, Torgerson 1952). A plane cannot show all: read a number off the heat map. Source code: "
        "irl/diagnostics/trajectory.py.",
    ),
    "terms": (
        "Terms of the hand-written reward",
        "r = c + Σ w T + γ φ(s') - φ(s) + e, fitted jointly, so that a potential's shaping is not booked on "
        "the terms. Standardised: w σ(T) / σ(r). Shares are Shapley's, of the variance in episodes left out; "
        "intervals are over episodes. Unexplained is what neither terms nor shaping account for. Source "
        "code: irl/diagnostics/terms.py.",
    ),
    "against": (
        "Learned against hand-written",
        "Counts of probe steps in hexagons, over all but the outermost thousandth. The line of each kind of "
        "play is least squares, its interval over episodes. Over segments: the VAL sums of both rewards, so "
        "that shaping does not scatter. A residual is the distance from one line through all steps, in "
        "standard deviations. Source code: irl/experiment/against.py.",
    ),
    "episodes": (
        "Episodes",
        "The deterministic policy's episode in the middle by return, and the worst. Every step's learned "
        "reward (what ends an episode is left out), hand-written reward and its terms, and their plain sums. "
        "Pictures are drawn by playing the recorded actions again. Source code: irl/experiment/filmed.py.",
    ),
    "crossplay": (
        "Cross-play",
        "Every policy's mean episode return under every snapshot's learned reward, as ranks within each row "
        "because the scale of a learned reward means nothing. Kendall's τ and Spearman's ρ compare the "
        "order of a row with the order by true return; regret is what is lost by picking the row's "
        "favourite, of the range. Intervals over episodes. Source code: irl/experiment/crossplay.py.",
    ),
    "gold": (
        "Proxy and gold",
        "Proxy: the last reward's return of each snapshot's policy; gold: the task's own. Decoupling: the "
        "first window in which the two no longer rise together. A curve d (α - β log d) is fitted only where "
        "it beats a monotone one (form of Gao et al. 2023, arXiv:2210.10760). Source code: "
        "irl/diagnostics/overoptimisation.py.",
    ),
    "retrain": (
        "Retrain and transfer",
        "A fresh policy from random weights, on the reward of one snapshot, frozen. Score: its true return "
        "between random (0) and expert (1). Ratio: how far it comes from random actions, of how far the "
        "policy comes that was trained beside the reward; of several seeds by their interquartile mean. Made "
        "by: irl retrain. Source code: irl/experiment/retrain.py.",
    ),
    "trust": (
        "Self-tests and coverage",
        "Own error: the distance found between the hand-written reward and itself with random shaping, which "
        "should be 0. Negation: that to its opposite, which should be 1. Random: that to a random network. "
        "Outside: the share of fresh policy steps that lie further from the probe than its own steps do from "
        "each other; of those nothing on this page speaks. Source code: irl/diagnostics/compare.py, "
        "irl/diagnostics/coverage.py.",
    ),
    "compare": (
        "Several runs",
        "The interquartile mean leaves the highest and the lowest quarter of the seeds out; its interval is "
        "of seeds drawn again, 2,000 times. With fewer than five seeds it says little. Curves are "
        "interpolated to common steps. Source code: irl/core/statistics.py.",
    ),
}


def explained() -> str:
    """All of it, as the section that the panels link to."""
    entries = "".join(
        f'<div id="how-{key}" tabindex="-1"><dt>{escape(title)}</dt><dd>{escape(words)}</dd></div>'
        for key, (title, words) in HOW.items()
    )
    return (
        '<section id="how" data-section="how" aria-labelledby="how-title">'
        f'<h2 id="how-title">How it is calculated</h2><dl class="explained">{entries}</dl></section>'
    )
